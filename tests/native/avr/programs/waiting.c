// Waits in all the ways that programs have, and leaves in memory and at its pins when it went on.
#define F_CPU 8000000UL
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

volatile uint16_t ticks, pulses;
volatile uint32_t sum;
volatile uint8_t cursor;
volatile uint16_t noted[128];

static void note(uint16_t value) {
    noted[cursor & 127] = value;
    cursor++;
    sum = sum * 31 + value;
}

ISR(TIMER0_COMPA_vect) {
    ticks++;
    sum = sum * 31 + TCNT0;
}

ISR(ANALOG_COMP_vect) {
    pulses++;
    sum = sum * 31 + TCNT1;
}

static void __attribute__((noinline)) show(uint8_t color) {
    const uint8_t flags = SREG;
    cli();
    DDRD = (DDRD & ~0x30) | (color & 3) << 4;
    DDRC = (DDRC & ~0x0C) | (color & 12);
    SREG = flags;
}

int main(void) {
    DDRD = PORTD = 1 << 2;  // power for the receiver
    TCCR0B = 1 << CS01 | 1 << CS00;
    OCR0A = 200;
    TIMSK0 = 1 << OCIE0A;
    TCCR1B = 1 << CS10;
    ACSR = 1 << ACIE | 1 << ACIS1 | 1 << ACIS0;
    sei();
    for (uint16_t round = 0;; round++) {
        const uint16_t begin = ticks;
        while (ticks == begin) show((uint8_t)(round & 3));  // calls and writes that change nothing
        note(TCNT1);
        _delay_us(20);  // a byte counted down
        note(TCNT1);
        _delay_us(700);  // two
        note(TCNT1);
        _delay_ms(60);  // three
        note(TCNT1);
        const uint16_t heard = pulses;
        for (uint16_t i = 0; i < 200 && pulses == heard; i++) show((uint8_t)(round & 7));
        note(TCNT1);
        while ((uint8_t)TCNT0 > 50) {
        }  // a counter that moves by itself
        note(TCNT1);
    }
}
