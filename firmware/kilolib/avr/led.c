#include <util/atomic.h>

#include "board.h"
#include "kilolib.h"

// Bits 0 to 5 of a colour are two of red, green and blue each. The pins: port D 5 and 4, port C 3
// and 2, port C 5 and 4.
void set_color(uint8_t rgb) {
    uint8_t on_c = 0, on_d = 0;
    if (rgb & BIT(0)) on_d |= BIT(PD5);
    if (rgb & BIT(1)) on_d |= BIT(PD4);
    if (rgb & BIT(2)) on_c |= BIT(PC3);
    if (rgb & BIT(3)) on_c |= BIT(PC2);
    if (rgb & BIT(4)) on_c |= BIT(PC5);
    if (rgb & BIT(5)) on_c |= BIT(PC4);
    // A command switches the motors by the same register.
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        DDRC = (uint8_t)((DDRC & ~LED_ON_C) | on_c);
        DDRD = (uint8_t)((DDRD & ~LED_ON_D) | on_d);
    }
}
