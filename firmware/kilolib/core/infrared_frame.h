/// Infrared frames: their layout and timing, and the reader that turns edges into messages
/// (hardware.md 1.6). Robots, the modules of a Kilogrid and the emulator's channel share them.
///
/// A frame is a leader byte of zero and the twelve bytes of a message. A byte is ten slots: a start
/// pulse, eight bits from the lowest on, of which a 1 is a pulse and a 0 is none, a stop pulse. In
/// the leader the sender listens: start pulse, two slots of rest, then looks at the comparator up
/// to the stop pulse. Light seen there ends the attempt.
///
/// Times are cycles of 125 ns, as timer 1 counts them. Pure: no registers, no clock, nothing
/// allocated.
#ifndef KILOLIB_CORE_INFRARED_FRAME_H
#define KILOLIB_CORE_INFRARED_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "../include/message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SLOT_CYCLES 269  ///< 33.625 us: 29.74 kbit/s
#define BYTE_SLOTS 10    ///< of a start, eight bits and a stop
#define STOP_SLOT 9      ///< of a byte; slot 0 is the start pulse, slots 1 to 8 are the bits
#define FRAME_BYTES 13   ///< with the leader
#define PULSE_CYCLES 9   ///< the LED is on for so long

/// The leader, after its start pulse: slots of rest, then polls of the comparator.
#define LEADER_REST_SLOTS 2  ///< the receiver recovers from the start pulse
#define LEADER_POLLS 235     ///< about seven slots: the window of carrier sense
#define POLL_CYCLES 8        ///< of the chip's loop

/// Without a byte's end for so long after its start the frame is over.
#define BYTE_TIMEOUT (11 * SLOT_CYCLES)

/// Meaning of an edge of the comparator's output.
typedef enum {
    EDGE_OF_FRAME,     ///< a bit, or the start or stop of a byte: the frame goes on
    EDGE_BEGINS,       ///< the leader's start
    EDGE_ENDS_LEADER,  ///< the leader's stop
    EDGE_COMPLETES,    ///< the last stop: reader->message is there
    EDGE_SPOILS,       ///< fits no frame, or two at the same time: the frame is dropped
} infrared_edge_t;

/// A frame that is being received. Written by the interrupts of the comparator and its timer only;
/// `receiving` and `bytes` may be read by the main program, each by itself.
typedef struct {
    volatile bool receiving;  ///< from the leader's start to the end, however it comes
    bool in_byte;             ///< between a start and a stop pulse
    volatile uint8_t bytes;   ///< complete ones, with the leader: 0..12
    uint8_t bits;             ///< of the current byte
    uint16_t byte_start;      ///< time of its start pulse
    message_t message;        ///< valid from EDGE_COMPLETES to the next leader's end
} infrared_reader_t;

/// Drops what was received of a frame. The next edge is a leader's start.
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

/// Takes a rising edge at `now`, a count of timer 1 that wraps. The bit's slot is the distance from
/// the byte's start, less half a slot, divided by 269; an edge outside of 0.5 to 9.5 slots fits no
/// frame. Inline, and without a division: an edge may be followed by the next after 269 cycles.
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

#ifdef __cplusplus
}
#endif

#endif
