/// The serial line out of the robot: 38,400 baud, 8 bits, no parity, one stop bit, on PD1.
#ifndef KILOLIB_AVR_UART_H
#define KILOLIB_AVR_UART_H

#include "board.h"

/// As programs' terminals expect it: 0.26 ms a character.
#define BAUD 38400UL

/// Transmitter only. Pieces of text are lost when the robot sleeps meanwhile.
static inline void uart_init(void) {
    UBRR0 = (uint16_t)((F_CPU + 8 * BAUD) / (16 * BAUD) - 1);
    UCSR0A = 0;
    UCSR0C = BIT(UCSZ01) | BIT(UCSZ00);
    UCSR0B = BIT(TXEN0);
}

#endif
