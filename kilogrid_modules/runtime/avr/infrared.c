#include "infrared.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "../../../firmware/kilolib/avr/frame_sender.h"
#include "../../../firmware/kilolib/avr/gains_read.h"
#include "../../../firmware/kilolib/core/infrared_frame.h"
#include "../core/traits.h"
#include "../core/turns.h"
#include "board.h"
#include "commands.h"
#include "moduleIR.h"

// 1 MHz; a conversion takes 13.5 cycles of it.
#define CONVERTER_ON (BIT(ADEN) | BIT(ADATE) | BIT(ADPS1) | BIT(ADPS0))
#define ON_COMPARATOR_EDGE BIT(ADTS0)
#define ON_TIMER_MATCH (BIT(ADTS2) | BIT(ADTS0))
// The low gain is selected this long before the leader's stop, and sampled this long into it.
#define LOW_GAIN_AHEAD (SLOT_CYCLES / 2)
#define INTO_PULSE 8

static infrared_reader_t reader;
static distance_measurement_t distance;
static uint8_t listening_cell;
static bool at_low_gain;
static gain_tables_t tables;

static message_t messages[N_CELLS];
static volatile uint8_t repeating;  // bit per cell

static void ignore_rx(IR_message_t *message, cell_num_t cell, distance_measurement_t *measured,
                      uint8_t crc_error) {
    (void)message, (void)cell, (void)measured, (void)crc_error;
}
static void ignore_tx_success(cell_num_t cell) { (void)cell; }

IR_message_rx_t module_IR_message_rx = ignore_rx;
IR_message_tx_success_t module_IR_message_tx_success = ignore_tx_success;

static void select_receiver(uint8_t gain) {
    const uint8_t address = (uint8_t)((listening_cell << 1 | gain) << RECEIVER_SHIFT);
    PORTC = (uint8_t)((PORTC & ~RECEIVER_ADDRESS) | address);
}

// The chip's own light, or a change of the gain, made an edge.
static void forget_edge(void) { ACSR |= BIT(ACI); }

static void wait_for_frame(void) {
    TIMSK1 = 0;
    at_low_gain = false;
    select_receiver(RECEIVER_HIGH_GAIN);
    ADCSRB = ON_COMPARATOR_EDGE;
    ACSR = BIT(ACIC) | BIT(ACIE) | BIT(ACIS1) | BIT(ACIS0);
}

void runtime_infrared_init(void) {
    kilolib_gains_read(&tables);
    PORTB &= (uint8_t)~IR_LED;
    DDRB |= IR_LED;
    DDRD |= IR_LED_CELL;
    DDRC |= RECEIVER_ADDRESS;
    DIDR0 = BIT(RECEIVER_CHANNEL);
    DIDR1 = BIT(AIN0D) | BIT(AIN1D);
    ADMUX = CONVERTER_REFERENCE | RECEIVER_CHANNEL;
    ADCSRA = CONVERTER_ON;
    TCCR1A = 0;
    TCCR1B = BIT(ICES1) | BIT(CS10);
    infrared_reader_reset(&reader);
    wait_for_frame();
}

bool runtime_infrared_receiving(void) { return reader.receiving; }

// A frame in progress holds the receiver.
void runtime_infrared_listen_to_next_cell(void) {
    if (reader.receiving) return;
    listening_cell = turns_listening_after(listening_cell, 1);
    select_receiver(RECEIVER_HIGH_GAIN);
}

// The conversion has been started by the comparator or the timer; 13.5 us.
static int16_t sampled(void) {
    while (ADCSRA & BIT(ADSC)) {
    }
    return (int16_t)ADC;
}

// The leader's stop is too weak for the comparator at low gain, so it is sampled when it is due,
// and counts as seen.
static void begin_frame(void) {
    OCR1B = reader.byte_start + STOP_SLOT * SLOT_CYCLES - LOW_GAIN_AHEAD;
    TIFR1 = BIT(OCF1A) | BIT(OCF1B);
    TIMSK1 = BIT(OCIE1A) | BIT(OCIE1B);
    distance.high_gain = sampled();
}

// Switching the gain makes edges: the comparator's interrupt is off until the stop is past.
static void approach_stop(void) {
    at_low_gain = true;
    ACSR &= (uint8_t)~BIT(ACIE);
    select_receiver(RECEIVER_LOW_GAIN);
    ADCSRB = ON_TIMER_MATCH;
    OCR1B = reader.byte_start + STOP_SLOT * SLOT_CYCLES + INTO_PULSE;
}

static void pass_stop(void) {
    const uint16_t stop = reader.byte_start + STOP_SLOT * SLOT_CYCLES;
    distance.low_gain = sampled();
    const infrared_edge_t edge = infrared_reader_edge(&reader, stop);
    wait_for_frame();
    forget_edge();
    if (edge == EDGE_ENDS_LEADER) TIMSK1 = BIT(OCIE1A);
}

ISR(TIMER1_COMPB_vect) {
    if (at_low_gain) {
        pass_stop();
    } else {
        approach_stop();
    }
}

// The receiver waits for the next frame before the callback runs, which may take long. Answers of
// robots to the host's questions are not the program's.
static void take_message(void) {
    const bool wrong = message_crc(&reader.message) != reader.message.crc;
    wait_for_frame();
    if (!MODULE_ORIGINAL && !wrong &&
        robot_reports_add(&runtime_orders.reports, &reader.message, listening_cell))
        return;
    (*module_IR_message_rx)(&reader.message, (cell_num_t)listening_cell, &distance, wrong);
}

ISR(ANALOG_COMP_vect) {
    const infrared_edge_t edge = infrared_reader_edge(&reader, ICR1);
    OCR1A = reader.byte_start + BYTE_TIMEOUT;
    switch (edge) {
    case EDGE_BEGINS: begin_frame(); break;
    case EDGE_COMPLETES: take_message(); break;
    case EDGE_SPOILS: wait_for_frame(); break;
    default: break;
    }
}

// The next edge did not come in time.
ISR(TIMER1_COMPA_vect) {
    infrared_reader_reset(&reader);
    wait_for_frame();
}

// The cells share one transmitter, and its own light reaches the receiver.
infrared_attempt_t runtime_infrared_send_by(uint8_t cell, const message_t *message) {
    infrared_attempt_t attempt = INFRARED_RECEIVING;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (!reader.receiving) {
            PORTD = (uint8_t)((PORTD & ~IR_LED_CELL) | cell << IR_LED_CELL_SHIFT);
            attempt = kilolib_infrared_send_frame(message, IR_LED) ? INFRARED_SENT : INFRARED_BUSY;
            forget_edge();
        }
    }
    return attempt;
}

infrared_attempt_t runtime_infrared_repeat(uint8_t cell) {
    if ((repeating >> cell & 1) == 0) return INFRARED_SENT;
    const infrared_attempt_t attempt = runtime_infrared_send_by(cell, &messages[cell]);
    if (attempt == INFRARED_SENT) (*module_IR_message_tx_success)((cell_num_t)cell);
    return attempt;
}

void runtime_infrared_silence(void) { repeating = 0; }

void init_IR_message(IR_message_t *message) { memset(message, 0, sizeof *message); }

// The timer's interrupt reads the message: it is replaced with interrupts off.
void set_IR_message(IR_message_t *message, cell_num_t cell) {
    if (message == NULL || cell >= N_CELLS) {
        disable_IR_tx(cell);
        return;
    }
    IR_message_t copy = *message;
    copy.crc = message_crc(&copy);
    const uint8_t bit = BIT(cell);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        messages[cell] = copy;
        repeating |= bit;
    }
}

void disable_IR_tx(cell_num_t cell) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { repeating &= (uint8_t)~BIT(cell); }
}

void send_IR_message(IR_message_t *message, cell_num_t cell) {
    message->crc = message_crc(message);
    (void)runtime_infrared_send_by((uint8_t)(cell % N_CELLS), message);
}

uint8_t estimate_distance_mm(const distance_measurement_t *measured, cell_num_t cell) {
    (void)cell;
    return kilolib_gains_distance(&tables, measured);
}
