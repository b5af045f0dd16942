/// Passes of a translated robot's main loop that are known to change nothing, and until which tick.
///
/// Most passes of loop() find that it is not time yet: they read kilo_ticks, compare what they read
/// with variables, and change nothing. Such a pass goes the same way again in each tick until one
/// of these comparisons comes out differently. So what is noted of it is what it depends on: bytes
/// that have to be what they were, and comparisons of numbers that are sums of kilo_ticks,
/// variables and constants. A robot whose memory agrees need not execute the pass, nor those of the
/// ticks up to the first in which a comparison changes, whichever robot it was that was traced
/// (pass_tracer.h).
///
/// A loop() that works once a tick notes the tick that it has worked for: a variable that follows
/// kilo_ticks. Where that is all that such a pass changes it is known likewise, and so is an
/// interrupt that asks the program for a message and gets none.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PASSES_KNOWN_PASS_H
#define KILOTWIN_ROBOTS_TRANSLATED_PASSES_KNOWN_PASS_H

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace kilotwin {

/// A sum: `slope` times kilo_ticks, a constant, and bytes of the data space, each shifted.
struct TickNumber {
    struct Term {
        uint16_t address;
        uint8_t shift;
        int8_t sign;
        bool operator==(const Term &) const = default;
    };

    int slope = 0;
    uint64_t constant = 0;
    std::vector<Term> terms;

    /// Modulo 2^64, with the bytes of a robot's data space and its kilo_ticks.
    uint64_t value(const uint8_t *data, uint32_t ticks) const;
    /// Adds another one, or takes it off if `sign` is -1.
    void add(const TickNumber &other, int sign);
    bool operator==(const TickNumber &) const = default;
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
    bool operator==(const TickCondition &) const = default;
};

/// All that something depends on that is done again and again.
struct Dependence {
    struct Equal {
        uint16_t address;
        uint8_t value;
        bool operator==(const Equal &) const = default;
    };
    static constexpr uint32_t MOST_TICKS = 1u << 30;

    /// Bytes of registers, I/O and SRAM, by address; then what its branches asked of the ticks.
    std::vector<Equal> equal;
    std::vector<TickCondition> conditions;

    /// For how many ticks, this one included, it goes so; 0: it does not. At most MOST_TICKS.
    uint32_t lasts(const uint8_t *data, uint32_t ticks) const;
    /// Whether it has to do with one of the bytes from `address` on.
    bool has(uint16_t address, unsigned bytes) const;
};

/// A variable that a pass sets to kilo_ticks and a constant, in each tick anew.
struct TickFollower {
    uint16_t address;
    uint8_t bytes;
    uint64_t ahead;  ///< the constant; of it and of the sum that many bytes count

    /// Whether it has been set in this tick.
    bool follows(const uint8_t *data, uint32_t ticks) const;
};

/// A pass that changes nothing, and what becomes of it in a tick.
struct KnownPass {
    /// What follows when the tick's interrupt falls into the pass. An entry holds for interrupts
    /// later than the previous entry's `to` and no later than its own. Both count from the start
    /// of the pass: `cycles` to the start of the next pass that changes nothing, the interrupt
    /// left out.
    struct Torn {
        uint16_t to, cycles;
    };
    static constexpr size_t MOST_FOLLOWERS = 2;

    uint32_t pc;      ///< byte address of its begin
    uint16_t stack;   ///< pointer at that moment
    uint8_t status;   ///< flags T and I, as in the status register
    uint32_t cycles;  ///< of the pass
    /// The first of a tick, which sets the followers; without any it is as the others.
    uint32_t work_cycles;
    /// A tick that comes later than at `reads_from`, at `reads_to` at the latest, comes between
    /// reads of kilo_ticks: cycles from the begin of the pass on. Where it is torn so, as far as
    /// that is known.
    uint32_t reads_from = 0, reads_to = 0;
    std::vector<Torn> torn;
    std::vector<TickFollower> followers;
    Dependence rest;  ///< of the pass
    Dependence work;  ///< of a tick that comes into one, asked as of that tick
    mutable uint8_t looks_for_followers = 0;  ///< how often none were found

    /// Adds to `work` what `rest` does not say: that holds up to the tick before the end as well.
    void add_to_work(const Dependence &more);
    /// For how many ticks, this one included, passes go so; 0: they do not.
    uint32_t lasts(const uint8_t *data, uint32_t ticks) const;
};

/// A tick's interrupt that asks the program for a message, gets none, and changes nothing but the
/// clock.
struct KnownAsk {
    Dependence on;  ///< asked as of the tick before
    uint32_t cycles;
};

/// Some of a kind; a new one takes the place of the oldest if there is no room. Robots at rest do
/// not name them: what they need of them is in their image.
template <typename Known> struct KnownOnes {
    static constexpr size_t MOST = 16;

    std::vector<Known> all;
    size_t next = 0;

    const Known &keep(Known known) {
        if (all.size() < MOST) return all.emplace_back(std::move(known));
        Known &place = all[next++ % MOST];
        return place = std::move(known);
    }
};

/// Those of a program, found as its robots run. Which of them are known changes the cost alone.
struct KnownPasses {
    static constexpr uint32_t FREE_TRACES = 64, LOOKS_FOR_A_TRACE = 2048;

    KnownOnes<KnownPass> passes;  ///< each of any robot of the program
    KnownOnes<KnownAsk> asks;
    uint64_t looks = 0;  ///< for a known pass
    uint64_t traces = 0, asks_traced = 0;

    /// Tracing a pass takes as long as executing hundreds.
    bool may_trace_pass() const { return may_trace(traces); }
    bool may_trace_ask() const { return may_trace(asks_traced); }

  private:
    bool may_trace(uint64_t done) const { return done < FREE_TRACES + looks / LOOKS_FOR_A_TRACE; }
};

}  // namespace kilotwin

#endif
