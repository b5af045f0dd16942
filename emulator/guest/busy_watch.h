/// Tells a program that waits from one that computes, when it does not come back.
///
/// The program counts its turns down from a budget: of its loops, or (built by clang) through each
/// basic block. When that is spent, the program's memory is looked at turn by turn: if it comes back
/// to where it was, the program goes round in circles until an interrupt changes something. If not,
/// it computes, which must end some day.
#ifndef KILOTWIN_GUEST_BUSY_WATCH_H
#define KILOTWIN_GUEST_BUSY_WATCH_H

#include <cstdint>
#include <memory>

#include "base/clock.h"
#include "guest/program.h"

namespace kilotwin {

/// A turn takes an AVR about ten cycles, so a program may take this many in a tick's time.
constexpr int32_t TURNS_PER_TICK = TICK_CYCLES / 10;

class BusyWatch {
  public:
    enum class Finding : uint8_t {
        LOOKING,  ///< go on for one turn
        WAITS,    ///< nothing changes until the next interrupt
        COMPUTES,
    };
    enum class Verdict : uint8_t {
        FINE,
        WARN,     ///< busy for ten seconds, said once
        ENDLESS,  ///< has computed for a minute without calling the API
    };
    static constexpr Cycles WARN_AFTER = 10 * CYCLES_PER_SECOND;
    static constexpr const char *WARNING =
        "it has been busy for 10 s without coming back or calling delay()";
    static constexpr const char *ACCUSATION =
        "it has been computing for 60 s without coming back or calling the API";

    /// The program came back, or gave time back: it gets a fresh `budget`.
    void came_back(int32_t &budget) {
        budget = TURNS_PER_TICK;
        if (watch_) [[unlikely]]
            watch_.reset();
    }

    /// The program acted or looked about by a call that takes no time: whatever it computes, it has
    /// not lost its way.
    void called() {
        if (watch_) watch_->computing_since = NEVER;
    }

    /// The budget was spent at `now`; the program's frames lie from `frame` to `top`. Unless it is
    /// LOOKING, time has to pass up to the next interrupt.
    Finding look(const Program &program, const uint8_t *frame, const uint8_t *top);

    /// What to make of a finding at `now`.
    Verdict judge(Finding finding, Cycles now);

  private:
    struct Watch {
        uint64_t fingerprint = 0;        ///< of the memory when the budget was last spent
        Cycles busy_since = NEVER;       ///< since when the program has not come back
        Cycles computing_since = NEVER;  ///< since when it has changed memory all the time
        uint16_t probes_left = 0;        ///< looks at the memory until it counts as computing
        bool warned = false;
    };
    std::unique_ptr<Watch> watch_;  ///< once the budget is spent, until the program comes back
};

}  // namespace kilotwin

#endif
