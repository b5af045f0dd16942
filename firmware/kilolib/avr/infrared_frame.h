/// Frames of infrared light, pulse by pulse (hardware.md 1.6). Robots and the Kilogrid's modules
/// share it.
///
/// A frame is a leader byte of zero and the twelve bytes of a message. A byte is ten slots: a start
/// pulse, eight bits from the lowest on, of which a 1 is a pulse and a 0 is none, a stop pulse.
/// Times are cycles of 125 ns, as timer 1 counts them.
#ifndef KILOLIB_AVR_INFRARED_FRAME_H
#define KILOLIB_AVR_INFRARED_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "message.h"

#define SLOT_CYCLES 269
#define BYTE_SLOTS 10
#define STOP_SLOT 9

/// Without a byte's end for so long after its start the frame is over.
#define BYTE_TIMEOUT (11 * SLOT_CYCLES)

/// Sends the message as it is, crc included, in 4.37 ms, by the LED at `pins` of port B. False if
/// the comparator saw light in the leader, after which nothing more is sent. Interrupts have to be
/// off.
bool kilolib_infrared_send_frame(const message_t *message, uint8_t pins);

/// What an edge of the comparator's output was.
typedef enum {
    EDGE_OF_FRAME,     ///< nothing special: the frame goes on
    EDGE_BEGINS,       ///< the leader's start
    EDGE_ENDS_LEADER,  ///< the leader's stop
    EDGE_COMPLETES,    ///< the last one: reader->message is there
    EDGE_SPOILS,       ///< fits no frame, or two at the same time: the frame is forgotten
} infrared_edge_t;

/// A frame that is coming in.
typedef struct {
    volatile bool receiving;
    bool in_byte;
    volatile uint8_t bytes;  ///< complete ones, with the leader
    uint8_t bits;
    uint16_t byte_start;
    message_t message;
} infrared_reader_t;

static inline void infrared_reader_reset(infrared_reader_t *reader) {
    reader->receiving = false;
    reader->in_byte = false;
    reader->bytes = 0;
}

// Bits in the leader are those of another frame: two are sending at the same time.
static inline infrared_edge_t infrared_reader_end_byte(infrared_reader_t *reader) {
    const uint8_t byte = reader->bytes;
    reader->in_byte = false;
    if (byte == 0) {
        if (reader->bits != 0) {
            infrared_reader_reset(reader);
            return EDGE_SPOILS;
        }
        reader->bytes = 1;
        return EDGE_ENDS_LEADER;
    }
    ((uint8_t *)&reader->message)[byte - 1] = reader->bits;
    if (byte < sizeof reader->message) {
        reader->bytes = (uint8_t)(byte + 1);
        return EDGE_OF_FRAME;
    }
    infrared_reader_reset(reader);
    return EDGE_COMPLETES;
}

/// Takes an edge at `now`. Inline, and without a division: there are only as many cycles to the next
/// edge as that takes.
static inline infrared_edge_t infrared_reader_edge(infrared_reader_t *reader, uint16_t now) {
    const uint16_t half_slot = SLOT_CYCLES / 2;
    const uint32_t inverse = (1UL << 24) / SLOT_CYCLES + 1;
    if (!reader->in_byte) {
        reader->in_byte = true;
        reader->byte_start = now;
        reader->bits = 0;
        if (reader->receiving) return EDGE_OF_FRAME;
        reader->receiving = true;
        return EDGE_BEGINS;
    }
    const uint16_t since = (uint16_t)(now - reader->byte_start);
    if (since < half_slot || since > STOP_SLOT * SLOT_CYCLES + half_slot) {
        infrared_reader_reset(reader);
        return EDGE_SPOILS;
    }
    const uint8_t bit = (uint8_t)((uint16_t)(since - half_slot) * inverse >> 24);
    if (bit >= STOP_SLOT - 1) return infrared_reader_end_byte(reader);
    const uint8_t mask = (uint8_t)(1 << bit);
    reader->bits |= mask;
    return EDGE_OF_FRAME;
}

#endif
