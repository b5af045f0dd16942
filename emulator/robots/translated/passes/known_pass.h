/// Passes of a translated robot's main loop that are known not to change its state, and up to which
/// tick (docs/passes.md, 3).
///
/// Most passes of loop() poll: they read kilo_ticks, compare it with variables, and change nothing.
/// Such a pass takes the same path in each tick until one of its branches goes the other way. So
/// what is kept of it is its path condition: bytes that must have the value they had, and
/// comparisons of linear forms over kilo_ticks and variables. A robot whose state meets the
/// condition need not execute the pass, nor those of the ticks up to the first in which a
/// comparison flips, whichever robot of the program was traced (pass_tracer.h).
///
/// A loop() that acts once a tick stores the tick in which it has acted. Such a variable is a copy
/// of the clock. Where a pass changes nothing but copies it is known likewise, and so is an
/// interrupt that requests a message of the program and gets none.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PASSES_KNOWN_PASS_H
#define KILOTWIN_ROBOTS_TRANSLATED_PASSES_KNOWN_PASS_H

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/registers.h"

namespace kilotwin {

/// A linear form: `slope` times kilo_ticks, a constant, and bytes of the data space, each shifted.
struct LinearForm {
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
    void add(const LinearForm &other, int sign);
    bool operator==(const LinearForm &) const = default;
};

/// The condition of a branch, on numbers of some bits.
struct BranchCondition {
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
    LinearForm a, b;

    /// For how many ticks, this one included, the branch goes this way; 0: it does not. The number
    /// may be too small where both numbers move.
    uint64_t lasts(const uint8_t *data, uint32_t ticks) const;
    bool operator==(const BranchCondition &) const = default;
};

/// The path condition of a pass, or of an interrupt: a state that meets it takes the same path.
struct PathCondition {
    struct Equal {
        uint16_t address;
        uint8_t value;
        bool operator==(const Equal &) const = default;
    };
    static constexpr uint32_t MOST_TICKS = 1u << 30;

    /// Bytes of registers, I/O and SRAM, by address; then conditions on the clock.
    std::vector<Equal> equal;
    std::vector<BranchCondition> conditions;
    /// Bytes that are other ones meanwhile, and those of the stack.
    std::bitset<atmega328p::SRAM_END> changes;

    /// For how many ticks, this one included, a state meets it; 0: it does not. At most MOST_TICKS.
    uint32_t lasts(const uint8_t *data, uint32_t ticks) const;
    /// Whether it reads one of the bytes from `address` on.
    bool has(uint16_t address, unsigned bytes) const;
};

/// A copy of the clock: a variable that the first pass of each tick sets to kilo_ticks and a
/// constant.
struct ClockCopy {
    uint16_t address;
    uint8_t bytes;
    uint64_t ahead;  ///< the constant; of it and of the sum that many bytes count

    /// Whether it holds this tick.
    bool holds(const uint8_t *data, uint32_t ticks) const;
};

/// A pass that changes nothing but copies of the clock, and the paths that it takes when a tick
/// interrupts it.
struct KnownPass {
    /// A path that a tick's interrupt in the midst of the pass leads to. It is taken if the
    /// interrupt comes later than the previous entry's `to` and no later than its own, in cycles
    /// from the start of the pass. `cycles` are those from there to the start of the next pass that
    /// changes nothing, without the interrupt.
    struct Interrupted {
        uint16_t to, cycles;
    };
    static constexpr size_t MOST_COPIES = 2;

    uint32_t pc;      ///< byte address of its begin
    uint16_t stack;   ///< pointer at that moment
    uint8_t status;   ///< flags T and I, as in the status register
    uint32_t cycles;  ///< of the pass
    /// Cycles of the first pass of a tick, which sets the copies; without copies those of the
    /// others.
    uint32_t first_cycles;
    /// Cycles from the start of the pass: the path of a pass that is interrupted later than at
    /// `reads_from` and no later than at `reads_to`, between its reads of kilo_ticks, is in
    /// `interrupted`, as far as it is known.
    uint32_t reads_from = 0, reads_to = 0;
    std::vector<Interrupted> interrupted;
    std::vector<ClockCopy> copies;
    PathCondition rest;                    ///< of the pass
    PathCondition first;                   ///< of the first pass of a tick, in that tick
    mutable uint8_t looks_for_copies = 0;  ///< how often none were found

    /// Adds to `first` what `rest` does not imply, which is checked up to the tick before the end,
    /// and its changes.
    void add_to_first(const PathCondition &more);
    /// For how many ticks, this one included, passes take these paths; 0: they do not.
    uint32_t lasts(const uint8_t *data, uint32_t ticks) const;
};

/// A tick's interrupt that requests a message of the program, gets none, and changes nothing but
/// the clock.
struct KnownRequest {
    PathCondition on;  ///< in the tick before
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
    KnownOnes<KnownRequest> requests;
    uint64_t looks = 0;  ///< for a known pass
    uint64_t traces = 0, requests_traced = 0;

    /// Tracing a pass takes as long as executing hundreds.
    bool may_trace_pass() const { return may_trace(traces); }
    bool may_trace_request() const { return may_trace(requests_traced); }

  private:
    bool may_trace(uint64_t done) const { return done < FREE_TRACES + looks / LOOKS_FOR_A_TRACE; }
};

}  // namespace kilotwin

#endif
