#include "clock.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "board.h"
#include "infrared.h"
#include "module.h"

// The timer counts units of 128 us; a tick is 256 of them. A cell has its turn each 4 ticks, and
// the receiver stays at one for 10.24 ms.
#define TICK_MATCH 255
#define TURN_PERIOD 977
#define RECEIVER_PERIOD 80
#define UNITS_PER_16_SECONDS 125000UL
#define SECONDS_MAX 65535UL

volatile uint32_t module_ticks;

static uint16_t tx_clock;   // units since the last turn
static uint16_t increment;  // what the next match adds to it
static uint8_t turn;        // the cell that had the last one
static uint32_t units;

void runtime_clock_init(void) {
    module_ticks = 0;
    tx_clock = 0;
    units = 0;
    increment = TICK_MATCH;
    TCCR0A = BIT(WGM01);
    TCCR0B = BIT(CS02) | BIT(CS00);
    TCNT0 = 0;
    OCR0A = TICK_MATCH;
    OCR0B = RECEIVER_PERIOD;
    TIFR0 = BIT(OCF0A) | BIT(OCF0B);
    TIMSK0 = BIT(OCIE0A) | BIT(OCIE0B);
}

void runtime_clock_stop(void) { TIMSK0 = 0; }

uint16_t runtime_clock_uptime(void) {
    uint32_t passed = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { passed = units; }
    const uint32_t seconds = passed / (UNITS_PER_16_SECONDS / 16);
    return (uint16_t)(seconds < SECONDS_MAX ? seconds : SECONDS_MAX);
}

// A cell that finds the channel busy waits for its next turn, but the timer starts anew with a
// random match, as on a robot, and that counts as a tick.
static void start_anew(void) {
    const uint8_t drawn = (uint8_t)rand();
    increment = drawn == 0 ? TICK_MATCH + 1 : drawn;
    OCR0A = (uint8_t)(increment - 1);
    TCNT0 = 0;
}

static void take_turn(void) {
    const uint8_t cell = (uint8_t)((turn + 1) % N_CELLS);
    const infrared_attempt_t attempt = runtime_infrared_repeat(cell);
    if (attempt == INFRARED_RECEIVING) return;
    turn = cell;
    tx_clock = 0;
    if (attempt == INFRARED_BUSY) start_anew();
}

ISR(TIMER0_COMPA_vect) {
    tx_clock += increment;
    units += (uint16_t)(OCR0A + 1);
    increment = TICK_MATCH;
    OCR0A = TICK_MATCH;
    module_ticks++;
    if (tx_clock > TURN_PERIOD) take_turn();
}

ISR(TIMER0_COMPB_vect) {
    OCR0B = (uint8_t)(OCR0B + RECEIVER_PERIOD);
    runtime_infrared_listen_to_next_cell();
}
