// Shows a colour, drives both motors, sends three pulses 269 cycles apart and prints a line.
#define F_CPU 8000000UL
#include <avr/io.h>
#include <util/delay.h>
#include <util/delay_basic.h>

static void print(const char *text) {
    while (*text != 0) {
        while ((UCSR0A & 1 << UDRE0) == 0) {
        }
        UDR0 = (uint8_t)*text++;
    }
}

static void pulse(void) {
    PORTB |= 1 << 0;
    __builtin_avr_delay_cycles(7);
    PORTB &= ~(1 << 0);
}

int main(void) {
    DDRB = 1 << 0 | 1 << 3;
    DDRC = 1 << 3 | 1 << 2;  // green, full
    DDRD = 1 << 3 | 1 << 5;  // red, dim
    TCCR2A = 1 << COM2A1 | 1 << COM2B1 | 1 << WGM20;
    TCCR2B = 1 << CS21;
    OCR2A = 70;
    OCR2B = 75;
    for (uint8_t i = 0; i < 3; i++) {
        pulse();
        __builtin_avr_delay_cycles(255);
    }
    UBRR0 = 12;  // 38400 baud
    UCSR0B = 1 << TXEN0;
    print("hello\n");
    _delay_ms(3);
    DDRB &= ~(1 << 3);  // left motor off
    for (;;) {
    }
}
