// Interrupts whose flag went up while they were disabled, and the other way round.
#include <avr/interrupt.h>
#include <avr/io.h>

volatile uint8_t late, never, at_once, edges, done;

ISR(TIMER0_COMPA_vect) { late++; }
ISR(TIMER0_COMPB_vect) { never++; }
ISR(INT0_vect) { edges++; }

int main(void) {
    TCCR0B = 1 << CS00;
    OCR0A = OCR0B = 100;
    TIFR0 = 0xFF;
    while ((TIFR0 & 1 << OCF0A) == 0) {
    }
    TCCR0B = 0;
    // Its flag waits for it.
    sei();
    TIMSK0 = 1 << OCIE0A;
    __asm__ volatile("nop");
    at_once = late;
    TIMSK0 = 0;

    // One that waits for its turn is disabled before that comes; the flag stays.
    cli();
    TIFR0 = 0xFF;
    TCNT0 = 90;
    TIMSK0 = 1 << OCIE0B;
    TCCR0B = 1 << CS00;
    while ((TIFR0 & 1 << OCF0B) == 0) {
    }
    TCCR0B = 0;
    TIMSK0 = 0;
    sei();
    __asm__ volatile("nop");
    cli();
    if ((TIFR0 & 1 << OCF0B) == 0) never = 99;

    // A pin's edge, too: PD2, which drives itself.
    EICRA = 1 << ISC01;
    DDRD = PORTD = 1 << 2;
    EIFR = 1;
    PORTD = 0;
    __asm__ volatile("nop");
    EIMSK = 1;
    sei();
    __asm__ volatile("nop");
    done = 1;
    for (;;) {
    }
}
