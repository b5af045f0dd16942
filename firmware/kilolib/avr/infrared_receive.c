#include "infrared_receive.h"

#include <avr/interrupt.h>
#include <stdint.h>

#include "../core/infrared_frame.h"
#include "../core/traits.h"
#include "board.h"
#include "commands.h"
#include "converter.h"
#include "kilolib.h"
#include "robot.h"

static infrared_reader_t reader;
static volatile bool frame_began;
static bool forget;
// As with the reader's message: a callback's pointer is valid until it returns.
static distance_measurement_t distance;

static void wait_for_frame(void) {
    TIMSK1 = 0;
    kilolib_converter_sample_on_edge(HIGH_GAIN_CHANNEL);
}

void kilolib_infrared_receive_init(void) {
    TCCR1A = 0;
    TCCR1B = BIT(ICES1) | BIT(CS10);
    DIDR1 = BIT(AIN0D) | BIT(AIN1D);
    infrared_reader_reset(&reader);
    wait_for_frame();
    // Rising edges, also to the capture unit of timer 1: it notes their time by itself, so that it
    // does not matter when the interrupt gets its turn. An edge that switching on makes is a byte
    // that times out.
    ACSR = BIT(ACIC) | BIT(ACIE) | BIT(ACIS1) | BIT(ACIS0);
}

// The interrupt goes off first: switching the comparator can make an edge.
void kilolib_infrared_receive_stop(void) {
    ACSR &= (uint8_t)~BIT(ACIE);
    ACSR = BIT(ACD);
    TIMSK1 = 0;
    infrared_reader_reset(&reader);
}

bool kilolib_infrared_in_frame(void) { return reader.receiving; }
bool kilolib_infrared_receiving(void) { return reader.receiving || (ACSR & BIT(ACI)) != 0; }
bool kilolib_infrared_measuring(void) { return reader.receiving && reader.bytes == 0; }

bool kilolib_infrared_frame_began(void) {
    const bool since = frame_began;
    frame_began = false;
    return since;
}

void kilolib_infrared_forget_edge(void) { forget = (ACSR & BIT(ACI)) != 0; }

static void begin_frame(void) {
    frame_began = true;
    TIFR1 = BIT(OCF1A);
    TIMSK1 = BIT(OCIE1A);
    distance.high_gain = kilolib_converter_sampled();
    kilolib_converter_sample_on_edge(LOW_GAIN_CHANNEL);
}

static void end_leader(void) {
    distance.low_gain = kilolib_converter_sampled();
    kilolib_converter_sample_on_edge(HIGH_GAIN_CHANNEL);
}

static void take_message(message_t *message) {
    wait_for_frame();
    if (message_crc(message) != message->crc) return;
    if (message_is_command(message)) {
        robot_answer_hear(&kilolib_heard, message, &distance);
        kilolib_command_obey(message);
    } else {
        (*kilo_message_rx)(message, &distance);
    }
}

// The original goes by when the interrupt gets its turn, and so misreads an edge that has waited.
ISR(ANALOG_COMP_vect) {
    const uint16_t now = KILOLIB_ORIGINAL ? TCNT1 : ICR1;
    if (forget) {
        forget = false;
        return;
    }
    const infrared_edge_t edge = infrared_reader_edge(&reader, now);
    OCR1A = reader.byte_start + BYTE_TIMEOUT;
    switch (edge) {
    case EDGE_OF_FRAME: break;
    case EDGE_BEGINS: begin_frame(); break;
    case EDGE_ENDS_LEADER: end_leader(); break;
    case EDGE_COMPLETES: take_message(&reader.message); break;
    case EDGE_SPOILS: wait_for_frame(); break;
    }
}

// The next edge did not come in time.
ISR(TIMER1_COMPA_vect) {
    infrared_reader_reset(&reader);
    wait_for_frame();
}
