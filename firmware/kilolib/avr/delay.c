#include <util/delay.h>

#include "kilolib.h"

void delay(uint16_t ms) {
    for (; ms > 0; ms--) _delay_ms(1);
}
