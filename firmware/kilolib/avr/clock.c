#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdlib.h>

#include "board.h"
#include "infrared_receive.h"
#include "infrared_send.h"
#include "kilolib.h"
#include "states.h"

// The timer counts units of 128 us, from 0 to 255 and over again. A tick is a match with this.
#define TICK_MATCH 255
#define DEFAULT_TX_PERIOD 3906

volatile uint32_t kilo_ticks;
volatile uint16_t kilo_tx_period;

static uint16_t tx_clock;  // units since the last message sent
static uint8_t increment;  // what the next match adds to it

void kilolib_clock_init(void) {
    kilo_ticks = 0;
    kilo_tx_period = DEFAULT_TX_PERIOD;
    tx_clock = 0;
    increment = TICK_MATCH;
    TCCR0A = 0;
    TCCR0B = BIT(CS02) | BIT(CS00);
    TCNT0 = 0;
    OCR0A = TICK_MATCH;
    TIFR0 = BIT(OCF0A);
    TIMSK0 = BIT(OCIE0A);
}

void kilolib_clock_stop(void) { TIMSK0 = 0; }

// Whoever finds the channel busy tries again after a random part of a tick. The timer goes on
// meanwhile, so that the match for it comes on top of those at 255, and counts as a tick as well:
// ticks are faster where it is crowded.
static void try_to_send(void) {
    const message_t *message = (*kilo_message_tx)();
    if (message == NULL) return;
    if (kilolib_infrared_send(message)) {
        tx_clock = 0;
        (*kilo_message_tx_success)();
    } else {
        increment = (uint8_t)rand();
        OCR0A = increment;
    }
}

ISR(TIMER0_COMPA_vect) {
    tx_clock += increment;
    increment = TICK_MATCH;
    OCR0A = TICK_MATCH;
    kilo_ticks++;
    if (tx_clock > kilo_tx_period && kilolib_robot_state == STATE_RUNNING &&
        !kilolib_infrared_receiving()) {
        try_to_send();
    }
}
