/// State of a robot that runs translated: its chip, and where its execution stands.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_IMAGE_H
#define KILOTWIN_ROBOTS_TRANSLATED_IMAGE_H

#include <array>
#include <cstdint>

#include "base/registers.h"
#include "robots/translated/code.h"
#include "robots/translated/passes/known_pass.h"

namespace kilotwin {

/// Passes of the main loop that go on over ticks: what is needed of a KnownPass and a KnownRequest.
struct TickRest {
    struct Copy {
        uint16_t address;
        uint8_t bytes;
    };
    static constexpr size_t MOST_INTERRUPTED = 2;

    uint32_t ends;            ///< passes are so until kilo_ticks is this; 0: not over ticks
    uint16_t request_cycles;  ///< of an interrupt that asks and gets no message; 0: not known
    uint16_t first_cycles;
    uint16_t reads_from, reads_to;
    KnownPass::Interrupted
        interrupted[MOST_INTERRUPTED];    ///< in order; behind the last that is used, `to` is 0
    Copy copies[KnownPass::MOST_COPIES];  ///< likewise with `bytes`
    bool is_whole;  ///< it is known of all places of a pass what a tick there does
};

/// Plain bytes, copied as a whole. Times are the robot's own cycles since power-up.
struct TranslatedImage {
    static constexpr uint64_t NO_TIME = UINT64_MAX;
    enum class Interrupt : uint8_t { NONE, TICK, SERIAL, MESSAGE };

    std::array<uint8_t, atmega328p::SRAM_END> data;  ///< registers, I/O, SRAM
    std::array<uint8_t, 8> flags;                    ///< C Z N V S H T I, 0 or 1 each
    uint64_t cycle;                                  ///< executed up to here

    // Timer 0, and interrupts.
    uint64_t match;        ///< the next compare match
    uint64_t flagged;      ///< the one that waits for its interrupt; or NO_TIME
    uint64_t timer_zero;   ///< a moment at which it counted from 255 to 0
    uint64_t interrupted;  ///< begin of the interrupt that is served
    /// End of its last frame. The robot is run up to there before it is told of light that falls on
    /// it meanwhile.
    uint64_t sends_until;
    uint64_t held_back_until;  ///< no interrupt is let through before, though a tick's waits
    uint64_t forgotten;        ///< edges that wait then have nothing to say: the robot has sent
    uint64_t converted;        ///< end of the last conversion
    int16_t conversion;        ///< its result

    // Other peripherals.
    uint64_t asleep_until;  ///< 0: it is awake
    uint64_t serial_free;   ///< when the serial line takes the next byte

    // A pass of a loop: its state when it began.
    uint64_t pass_cycles;  ///< not 0: at pc a pass begins that changes nothing, and takes so long
    uint64_t pass_begun;   ///< when
    TickRest rest;         ///< goes on over ticks
    /// Where passes change something each time, looks for a known one come ever more seldom.
    int32_t recalls_in;     ///< of translated_chip_t
    uint16_t recall_pause;  ///< passes of the main loop from one look for a known one to the next
    translated_pass_t pass;
    uint64_t net;

    uint32_t pc;          ///< byte address
    int32_t turns;        ///< of translated_chip_t
    uint16_t ticks_away;  ///< since the main loop was passed
    uint8_t passed;       ///< of translated_chip_t, likewise the next one
    uint8_t changed;      ///< of translated_chip_t, by the pass that goes on; likewise `net`
    uint8_t latch;        ///< high byte of a count, read behind the low one
    Interrupt interrupt;  ///< the one that is served
    bool holds;           ///< that pass holds interrupts back for longer than MOST_HELD
    uint8_t waits_for;    ///< 1 + number of the engine's call that the channel has to answer
    bool strays;          ///< it has left its program, and goes through flash without code
    bool granted;         ///< the channel is known to be free for the frame of this interrupt
    bool is_timed;        ///< this tick's interrupt only counts, and its cycles are measured
};

/// A chip that is switched on: nothing is executed yet.
TranslatedImage switched_on();

}  // namespace kilotwin

#endif
