/// Serial line that a module program prints on: 38,400 baud, 8 bits, no parity, one stop bit, PD1.
#include <stdlib.h>

#include "board.h"
#include "debug.h"

#define BAUD 38400UL

// The line is set up by the first character: a program that prints nothing keeps the pin.
static void put(char character) {
    if (!(UCSR0B & BIT(TXEN0))) {
        UBRR0 = (uint16_t)((F_CPU + 8 * BAUD) / (16 * BAUD) - 1);
        UCSR0C = BIT(UCSZ01) | BIT(UCSZ00);
        UCSR0B = BIT(TXEN0);
    }
    while (!(UCSR0A & BIT(UDRE0))) {
    }
    UDR0 = (uint8_t)character;
}

void cprints_no_carriage(const char *text) {
    while (*text != '\0') put(*text++);
}

void cprints(const char *text) {
    cprints_no_carriage(text);
    put('\n');
}

void cprinti(int number) {
    char digits[8];
    cprints(itoa(number, digits, 10));
}
