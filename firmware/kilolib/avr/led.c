#include <util/atomic.h>

#include "../core/pins.h"
#include "kilolib.h"

void set_color(uint8_t rgb) {
    const led_pins_t on = led_pins(rgb);
    // A command switches the motors by the same register.
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        DDRC = (uint8_t)((DDRC & ~LED_MASK_C) | on.ddrc);
        DDRD = (uint8_t)((DDRD & ~LED_MASK_D) | on.ddrd);
    }
}
