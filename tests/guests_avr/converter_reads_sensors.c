// The converter's registers give what the API's functions give.
#include <avr/io.h>

#include "check.h"

static uint16_t convert(uint8_t channel) {
    ADMUX = channel;
    ADCSRA |= _BV(ADSC);
    loop_until_bit_is_clear(ADCSRA, ADSC);
    return ADCW;
}

static int is_near(int16_t a, int16_t b) { return a - b < 20 && b - a < 20; }

static void check(void) {
    CHECK(is_near((int16_t)convert(6), get_voltage()));
    CHECK(is_near((int16_t)convert(7), get_ambientlight()));

    ADMUX = _BV(ADLAR) | 6;
    ADCSRA |= _BV(ADSC);
    while (ADCSRA & _BV(ADSC)) {
    }
    CHECK(is_near((int16_t)(ADCH * 4), get_voltage()));
}
