// Registers that reach nothing in the emulator are memory, each by itself, whole or by halves.
#include <avr/io.h>

#include "check.h"

#define KEEPS(name)             \
    do {                        \
        name = 0xA5;            \
        CHECK(name == 0xA5);    \
        name &= (uint8_t)~0x05; \
        name |= _BV(1);         \
        CHECK(name == 0xA2);    \
    } while (0)

static void check(void) {
    KEEPS(TCCR1A);
    KEEPS(OCR0A);
    KEEPS(TIMSK1);
    KEEPS(PCMSK2);
    KEEPS(TWBR);
    KEEPS(ADMUX);
    KEEPS(GPIOR0);
    CHECK(OCR0A == 0xA2);  // the others did not touch it

    OCR1A = 0x1234;
    CHECK(OCR1AL == 0x34 && OCR1AH == 0x12);
    ICR1L = 0x78;
    ICR1H = 0x56;
    CHECK(ICR1 == 0x5678);
    UBRR0 = 12;
    CHECK(UBRR0L == 12 && UBRR0H == 0);

    volatile uint8_t *const by_pointer = &OCR0B;
    *by_pointer = 7;
    CHECK(OCR0B == 7);

    OCR0B = 0;
    loop_until_bit_is_clear(OCR0B, 3);
    OCR0B |= _BV(3);
    loop_until_bit_is_set(OCR0B, 3);
    CHECK(bit_is_set(PIND, PD0));  // not charging
}
