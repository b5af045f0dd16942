// Registers written directly do what set_motors() and set_color() do: a red LED, the left motor on
// at 60, the right one off for its pin is an input.
#include <avr/io.h>

#include "check.h"

static void check(void) {
    set_color(RGB(0, 0, 0));
    CHECK((DDRD & (_BV(PD4) | _BV(PD5))) == 0);

    set_color(RGB(3, 0, 0));
    CHECK(bit_is_set(DDRD, PD4) && bit_is_set(DDRD, PD5));
    CHECK(bit_is_clear(DDRC, PC2));

    set_motors(11, 22);
    CHECK(OCR2A == 11 && OCR2B == 22);

    DDRB |= _BV(PB3);
    DDRD &= (uint8_t)~_BV(PD3);
    OCR2A = 60;
    OCR2B = 60;
    CHECK(OCR2A == 60 && OCR2B == 60);
    CHECK(bit_is_set(DDRB, 3) && bit_is_clear(DDRD, 3));
}
