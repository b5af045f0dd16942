#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdlib.h>

#include "../core/calibration.h"
#include "board.h"
#include "infrared_receive.h"
#include "infrared_send.h"
#include "kilolib.h"
#include "robot.h"

volatile uint32_t kilo_ticks;
volatile uint16_t kilo_tx_period;

void kilolib_clock_init(void) {
    kilo_ticks = 0;
    kilo_tx_period = TX_PERIOD_DEFAULT;
    TCCR0A = 0;
    TCCR0B = BIT(CS02) | BIT(CS00);
    TCNT0 = 0;
    OCR0A = TICK_MATCH;
    TIFR0 = BIT(OCF0A);
    TIMSK0 = BIT(OCIE0A);
}

void kilolib_clock_stop(void) { TIMSK0 = 0; }

static void try_to_send(void) {
    const message_t *message = (*kilo_message_tx)();
    if (message == NULL) return;
    if (kilolib_infrared_send(message)) {
        transmit_clock_sent(&kilolib_robot.transmit);
        (*kilo_message_tx_success)();
    } else {
        OCR0A = transmit_clock_retry(&kilolib_robot.transmit, rand());
    }
}

// Apart, so that an ordinary tick need not make room for the message.
static void __attribute__((noinline)) try_to_answer(void) {
    message_t message;
    uint8_t content[REPORT_CONTENT];
    robot_answer_t *const answer = &kilolib_robot.answer;
    if (answer->first == ROBOT_QUERY_VITALS)
        robot_answer_vitals(&kilolib_heard, get_voltage(), content);
    else
        kilolib_calibration_gains(answer->first, content);
    robot_answer_fill(answer, &message, kilo_uid, kilolib_robot.state, content);
    if (kilolib_infrared_send(&message)) robot_answer_end(answer);
}

ISR(TIMER0_COMPA_vect) {
    transmit_clock_match(&kilolib_robot.transmit);
    OCR0A = TICK_MATCH;
    kilo_ticks++;
    if (robot_answer_is_due(&kilolib_robot.answer)) {
        if (!kilolib_infrared_receiving()) try_to_answer();
    } else if (transmit_clock_is_due(&kilolib_robot.transmit, kilo_tx_period) &&
               kilolib_robot.state == ROBOT_RUNNING && !kilolib_infrared_receiving()) {
        try_to_send();
    }
}
