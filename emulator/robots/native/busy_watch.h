/// Distinguishes a program that busy-waits from one that computes, when a callback does not return.
///
/// The guest counts its loop iterations down from a budget (count_loops.h; built by clang, its
/// basic blocks). Once that is spent, its memory is compared iteration by iteration: if a state
/// comes back, the program busy-waits, and time has to pass until an interrupt changes something.
/// If none does, it computes.
///
/// A part of the budget is held back once a program has busy-waited, so that its memory is
/// compared early. If a state comes back whole before the budget is spent, it would come back until
/// then: the turns up to there are skipped by whole periods, and the program is found waiting in
/// the same turn as without.
///
/// One per guest, owned by it. While a program returns in time, it costs two stores per callback.
#ifndef KILOTWIN_ROBOTS_NATIVE_BUSY_WATCH_H
#define KILOTWIN_ROBOTS_NATIVE_BUSY_WATCH_H

#include <cstdint>
#include <vector>

#include "base/clock.h"
#include "base/memory.h"
#include "robots/native/program.h"

namespace kilotwin {

/// Iterations that a print counts as which does not wait for the serial line: less time than a byte
/// takes there. So a program that prints for ever fills no memory before time passes.
constexpr int32_t TURNS_PER_PRINT = 100;

class BusyWatch {
  public:
    enum class Finding : uint8_t {
        LOOKING,   ///< undecided: run one more iteration
        WAITS,     ///< nothing changes until the next interrupt
        COMPUTES,  ///< no state came back within 512 iterations
    };
    enum class Verdict : uint8_t {
        FINE,
        WARN,     ///< busy for ten seconds; once until it returns
        ENDLESS,  ///< has computed for a minute without calling the API
    };
    static constexpr Cycles WARN_AFTER = 10 * CYCLES_PER_SECOND;
    static constexpr const char *WARNING =
        "it has been busy for 10 s without coming back or calling delay()";
    static constexpr const char *ACCUSATION =
        "it has been computing for 60 s without coming back or calling the API";

    /// To be called when a callback begins or returns, or lets time pass: resets `budget`.
    void came_back(int32_t &budget) {
        budget = TURNS_PER_TICK;
        if (watch_) [[unlikely]]
            watch_->forget();
    }

    /// The same for a program that may be looked at early.
    void came_back(Program &program, int32_t &budget) {
        came_back(budget);
        budget = program.turns_to_look;
        program.turns_held_back = TURNS_PER_TICK - budget;
    }

    /// To be called when the program calls the API without letting time pass: it is not in an
    /// endless computation.
    void called() {
        if (watch_) watch_->computing_since = NEVER;
    }

    /// To be called when the program does what can be told from outside without letting time pass,
    /// as a print: turns that do so are not skipped.
    void acted() {
        if (watch_) watch_->acts++;
    }

    /// To be called when the budget is spent, with the program's registers and frames from `frame`
    /// up to `top`. Sets the next budget. Unless the finding is LOOKING, time has to pass up to the
    /// next interrupt. Costs a pass over the program's state. A part of the next
    /// budget may be held back if the program looks_early.
    Finding look(Program &program, const uint8_t *frame, const uint8_t *top);

    /// The consequence of a finding, other than LOOKING, at `now` (cycles).
    Verdict judge(Finding finding, Cycles now);

  private:
    /// Since the program last came back.
    struct Turns {
        uint64_t fingerprint = 0;        ///< hash of the state that is waited for
        Cycles busy_since = NEVER;       ///< since then, no return
        Cycles computing_since = NEVER;  ///< since then, every look found it computing
        uint16_t probes_left = 0;        ///< looks until it counts as computing
        bool warned = false;

        // Early looks: a state is kept, and compared with those of the next turns.
        bool arrives = false;          ///< the next look is where it would be found waiting
        int32_t left_when_kept = 0;    ///< turns from then on up to where the budget is spent
        int32_t comparisons_left = 0;  ///< 0: the next state is kept
        /// Turns up to the next state to keep, if this one does not come back.
        int32_t spacing = 0;
        uint32_t acts = 0, acts_when_kept = 0;
    };
    struct Watch : Turns {
        std::vector<uint8_t> kept;

        void forget() { static_cast<Turns &>(*this) = {}; }
    };

    Finding look_early(Program &program, const uint8_t *frame, const uint8_t *top);
    Finding found_waiting(Program &program);
    static void look_after(int32_t turns, Program &program);  ///< the next time

    Own<Watch> watch_;  ///< from the first spent budget on
};

}  // namespace kilotwin

#endif
