// Bytes written to UDR0 are printed: "serial 0123456789" as one line, then "A" from a straight
// piece of code that never looks whether it is out.
#define F_CPU 8000000UL
#define BAUD 38400
#include <avr/io.h>
#include <util/setbaud.h>

#include "check.h"

static void put(char character) {
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = (uint8_t)character;
}

static void check(void) {
    UBRR0H = UBRRH_VALUE;
    UBRR0L = UBRRL_VALUE;
    CHECK(UBRR0 == 12 && USE_2X == 0);
    UCSR0B = _BV(TXEN0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);

    for (const char *c = "serial "; *c != '\0'; c++) put(*c);
    for (char digit = '0'; digit <= '9'; digit++) put(digit);
    put('\n');
    loop_until_bit_is_set(UCSR0A, TXC0);

    CHECK(bit_is_clear(UCSR0A, RXC0));  // nobody talks to a robot
    UDR0 = 'A';
}
