/// Passes of a translated robot's main loop that are known to change nothing, and until which tick.
///
/// Most passes of loop() find that it is not time yet: they read kilo_ticks, compare what they read
/// with variables, and change nothing. Such a pass goes the same way again in each tick until one
/// of these comparisons comes out differently. So what is noted of it is what it depends on: bytes
/// that have to be what they were, and comparisons of numbers that are sums of kilo_ticks,
/// variables and constants. A robot whose memory agrees need not execute the pass, nor those of the
/// ticks up to the first in which a comparison changes, whichever robot it was that was traced
/// (pass_tracer.h).
#ifndef KILOTWIN_GUEST_KNOWN_PASS_H
#define KILOTWIN_GUEST_KNOWN_PASS_H

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kilotwin {

/// A sum: `slope` times kilo_ticks, a constant, and bytes of the data space, each shifted.
struct TickNumber {
    struct Term {
        uint16_t address;
        uint8_t shift;
        int8_t sign;
    };

    int slope = 0;
    uint64_t constant = 0;
    std::vector<Term> terms;

    /// Modulo 2^64, with the bytes of a robot's data space and its kilo_ticks.
    uint64_t value(const uint8_t *data, uint32_t ticks) const;
    /// Adds another one, or takes it off if `sign` is -1.
    void add(const TickNumber &other, int sign);
};

/// A condition that a branch depends on: of numbers that have some bits.
struct TickCondition {
    enum class Kind : uint8_t {
        ZERO,        ///< a is 0
        BIT,         ///< bit `bit` of a is set
        LESS,        ///< a < b
        LESS_SIGNED  ///< the same of numbers with a sign
    };

    Kind kind;
    uint8_t bits;  ///< of the numbers, 8 to 64
    uint8_t bit;
    bool outcome;  ///< as the pass found it
    TickNumber a, b;

    /// For how many ticks, this one included, it comes out so; 0: it does not.
    /// It may say too few, where numbers go by two ways at once.
    uint64_t lasts(const uint8_t *data, uint32_t ticks) const;
};

/// A pass that changes nothing, by all that it depends on.
struct KnownPass {
    struct Equal {
        uint16_t address;
        uint8_t value;
    };
    static constexpr uint32_t MOST_TICKS = 1u << 30;

    uint32_t pc;      ///< byte address of its begin
    uint16_t stack;   ///< pointer at that moment
    uint8_t status;   ///< flags T and I, as in the status register
    uint32_t cycles;  ///< of the pass
    /// A tick that comes later than at `reads_from`, at `reads_to` at the latest, comes between
    /// reads of kilo_ticks: cycles from the begin of the pass on.
    uint32_t reads_from = 0, reads_to = 0;
    /// Bytes of registers, I/O and SRAM, by address; then what its branches asked of the ticks.
    std::vector<Equal> equal;
    std::vector<TickCondition> conditions;

    /// For how many ticks, this one included, the pass goes so; 0: it does not. At most MOST_TICKS.
    uint32_t lasts(const uint8_t *data, uint32_t ticks) const;
};

/// Those of a program, found as its robots run. Which of them are known changes the cost alone.
struct KnownPasses {
    static constexpr size_t MOST = 16;
    static constexpr uint32_t FREE_TRACES = 64, LOOKS_FOR_A_TRACE = 2048;

    std::vector<KnownPass> passes;  ///< each of any robot of the program
    uint32_t next = 0;  ///< the one that a new one takes the place of, if there is no room
    uint64_t looks = 0, traces = 0;  ///< for a known pass; for what a pass depends on

    /// Tracing a pass takes as long as executing hundreds.
    bool may_trace() const { return traces < FREE_TRACES + looks / LOOKS_FOR_A_TRACE; }
    /// Keeps a pass, in place of the oldest if there is no room; returns its number. Robots at rest
    /// do not name it: what they need of it is in their image.
    size_t keep(KnownPass pass);
};

}  // namespace kilotwin

#endif
