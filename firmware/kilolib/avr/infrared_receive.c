#include "infrared_receive.h"

#include <avr/interrupt.h>
#include <stdint.h>

#include "board.h"
#include "commands.h"
#include "converter.h"
#include "infrared_timing.h"
#include "kilolib.h"

#define FIRST_COMMAND 0x80
// Bytes of a frame with its leader.
#define FRAME_BYTES (1 + sizeof(message_t))

// Timer 1 notes the time of an edge by itself (input capture), so that it does not matter when the
// interrupt gets its turn.
#define EARLIEST_EDGE (SLOT_CYCLES / 2)
#define LATEST_EDGE (STOP_SLOT * SLOT_CYCLES + SLOT_CYCLES / 2)
#define BYTE_TIMEOUT (11 * SLOT_CYCLES)

static volatile bool receiving;
static volatile bool heard;
static bool forget;
static volatile uint8_t bytes;  // complete ones, with the leader
static bool in_byte;
static uint16_t byte_start;
static uint8_t bits;

// One of each: a callback's pointers are valid until it returns.
static union {
    message_t message;
    uint8_t bytes[sizeof(message_t)];
} received;
static distance_measurement_t distance;

static void wait_for_frame(void) {
    TIMSK1 = 0;
    receiving = false;
    in_byte = false;
    bytes = 0;
    converter_sample_on_edge(HIGH_GAIN_CHANNEL);
}

void infrared_receive_init(void) {
    TCCR1A = 0;
    TCCR1B = BIT(ICES1) | BIT(CS10);
    DIDR1 = BIT(AIN0D) | BIT(AIN1D);
    wait_for_frame();
    // Rising edges, also to the capture unit. One that switching on makes is a byte that times out.
    ACSR = BIT(ACIC) | BIT(ACIE) | BIT(ACIS1) | BIT(ACIS0);
}

// The interrupt goes off first: switching the comparator can make an edge.
void infrared_receive_stop(void) {
    ACSR &= (uint8_t)~BIT(ACIE);
    ACSR = BIT(ACD);
    TIMSK1 = 0;
    receiving = false;
}

bool infrared_in_frame(void) { return receiving; }
bool infrared_receiving(void) { return receiving || (ACSR & BIT(ACI)) != 0; }
bool infrared_measuring(void) { return receiving && bytes == 0; }

bool infrared_heard(void) {
    const bool since = heard;
    heard = false;
    return since;
}

void infrared_forget_edge(void) { forget = (ACSR & BIT(ACI)) != 0; }

static void begin_byte(uint16_t now) {
    byte_start = now;
    bits = 0;
    in_byte = true;
    OCR1A = now + BYTE_TIMEOUT;
    if (receiving) return;
    receiving = true;
    heard = true;
    TIFR1 = BIT(OCF1A);
    TIMSK1 = BIT(OCIE1A);
    distance.high_gain = converter_sampled();
    converter_sample_on_edge(LOW_GAIN_CHANNEL);
}

static void take_message(void) {
    wait_for_frame();
    if (message_crc(&received.message) != received.message.crc) return;
    if (received.message.type < FIRST_COMMAND) {
        (*kilo_message_rx)(&received.message, &distance);
    } else {
        command_obey(&received.message);
    }
}

// Bits in the leader are those of another robot's frame: two are sending at the same time.
static void end_byte(void) {
    in_byte = false;
    if (bytes == 0) {
        if (bits != 0) {
            wait_for_frame();
            return;
        }
        distance.low_gain = converter_sampled();
        converter_sample_on_edge(HIGH_GAIN_CHANNEL);
    } else {
        received.bytes[bytes - 1] = bits;
    }
    if (++bytes == FRAME_BYTES) take_message();
}

// floor(cycles / SLOT_CYCLES), by a multiplication: there are only as many cycles to the next edge
// as a division takes.
static uint8_t slots_in(uint16_t cycles) {
    const uint32_t factor = (1UL << 24) / SLOT_CYCLES + 1;
    return (uint8_t)(cycles * factor >> 24);
}

ISR(ANALOG_COMP_vect) {
    const uint16_t now = ICR1;
    if (forget) {
        forget = false;
        return;
    }
    if (!in_byte) {
        begin_byte(now);
        return;
    }
    const uint16_t since = now - byte_start;
    if (since < EARLIEST_EDGE || since > LATEST_EDGE) {
        wait_for_frame();
        return;
    }
    const uint8_t bit = slots_in(since - EARLIEST_EDGE);
    if (bit < STOP_SLOT - 1) {
        const uint8_t mask = BIT(bit);
        bits |= mask;
    } else {
        end_byte();
    }
}

// The next edge did not come in time.
ISR(TIMER1_COMPA_vect) { wait_for_frame(); }
