#include "clock.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "../core/turns.h"
#include "board.h"
#include "infrared.h"
#include "module.h"

// Units of 128 us, which timer 0 counts.
#define UNITS_PER_16_SECONDS 125000UL
#define SECONDS_MAX 65535UL

volatile uint32_t module_ticks;

static turns_t turns;
static uint32_t units;

void runtime_clock_init(void) {
    module_ticks = 0;
    units = 0;
    turns_init(&turns);
    TCCR0A = BIT(WGM01);
    TCCR0B = BIT(CS02) | BIT(CS00);
    TCNT0 = 0;
    OCR0A = TICK_MATCH;
    OCR0B = TURNS_DWELL_UNITS;
    TIFR0 = BIT(OCF0A) | BIT(OCF0B);
    TIMSK0 = BIT(OCIE0A) | BIT(OCIE0B);
}

void runtime_clock_stop(void) { TIMSK0 = 0; }

// Ticks are no measure of time: a retry makes one more.
uint16_t runtime_clock_uptime(void) {
    uint32_t passed = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { passed = units; }
    const uint32_t seconds = passed / (UNITS_PER_16_SECONDS / 16);
    return (uint16_t)(seconds < SECONDS_MAX ? seconds : SECONDS_MAX);
}

// In the timer's interrupt: a frame takes 4.4 ms, an eighth of the tick.
static void take_turn(void) {
    switch (runtime_infrared_repeat(turns_next_cell(&turns))) {
    case INFRARED_SENT: turns_passed(&turns); break;
    case INFRARED_BUSY:
        OCR0A = (uint8_t)(turns_retry(&turns, rand()) - 1);
        TCNT0 = 0;
        break;
    default: break;
    }
}

ISR(TIMER0_COMPA_vect) {
    units += (uint16_t)(OCR0A + 1);
    OCR0A = TICK_MATCH;  // a retry's random match holds once
    module_ticks++;
    if (turns_tick(&turns)) take_turn();
}

// The match value wraps as the timer does.
ISR(TIMER0_COMPB_vect) {
    OCR0B = (uint8_t)(OCR0B + TURNS_DWELL_UNITS);
    runtime_infrared_listen_to_next_cell();
}
