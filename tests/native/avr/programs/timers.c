// Measures timer 0 by timer 1, which counts cycles, and timer 1 by timer 0.
#include <avr/interrupt.h>
#include <avr/io.h>

// Between two compare matches of timer 0 in normal mode, for several compare values; and what the
// counter read when the flag was seen.
volatile uint16_t match_period[4];
volatile uint8_t match_count[4];
volatile uint16_t clear_period, overflow_period, fast_period;
volatile uint8_t counts_of_1600;
volatile uint8_t written, after_write;
volatile uint16_t to_overflow;
volatile uint8_t interrupts, done;

static const uint8_t compare_values[4] = {0, 1, 100, 255};

static uint16_t until_flag(uint8_t flag) {
    TIFR0 = flag;
    while ((TIFR0 & flag) == 0) {
    }
    return TCNT1;
}

static uint16_t period_of(uint8_t flag) {
    const uint16_t first = until_flag(flag);
    return until_flag(flag) - first;
}

ISR(TIMER0_COMPA_vect) {
    interrupts++;
    // A runtime that draws when to try again may draw 0.
    OCR0A = interrupts == 2 ? 0 : 0xFF;
}

int main(void) {
    TCCR1B = 1 << CS10;
    TCCR0B = 1 << CS01;  // 8 cycles a count
    for (uint8_t i = 0; i < 4; i++) {
        OCR0A = compare_values[i];
        match_period[i] = period_of(1 << OCF0A);
        match_count[i] = TCNT0;
    }
    overflow_period = period_of(1 << TOV0);
    TCNT0 = 200;
    written = TCNT0;
    uint16_t from = TCNT1;
    to_overflow = until_flag(1 << TOV0) - from;
    TCCR0A = 1 << WGM01;
    OCR0A = 99;
    clear_period = period_of(1 << OCF0A);
    TCCR0A = 1 << WGM01 | 1 << WGM00;
    OCR0A = 30;
    fast_period = period_of(1 << TOV0);

    TCCR0A = 0;
    TCNT0 = 0;
    OCR0A = 0xFF;
    TIFR0 = 0xFF;
    TIMSK0 = 1 << OCIE0A;
    sei();
    while (interrupts < 4) {
    }
    TIMSK0 = 0;

    TCCR0B = 1 << CS01;
    TCCR1B = 1 << WGM12 | 1 << CS10;
    OCR1A = 1599;
    TCNT1 = 0;
    TIFR1 = 1 << OCF1A;
    TCNT0 = 0;
    while ((TIFR1 & 1 << OCF1A) == 0) {
    }
    counts_of_1600 = TCNT0;
    done = 1;
    for (;;) {
    }
}
