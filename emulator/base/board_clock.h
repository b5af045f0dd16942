/// A board's own time: its oscillator may be off, and it began at power-up.
#ifndef KILOTWIN_BASE_BOARD_CLOCK_H
#define KILOTWIN_BASE_BOARD_CLOCK_H

#include "base/clock.h"

namespace kilotwin {

/// It counts TICK_CYCLES in what are `tick` of the world's cycles. Both conversions are exact to a
/// cycle; own_cycle(world_time(n)) is n, or an earlier cycle that falls on the same moment.
struct BoardClock {
    Cycles power_up, tick;

    /// World time of one of its cycles.
    Cycles world_time(uint64_t cycle) const {
        return power_up + cycle / TICK_CYCLES * tick + cycle % TICK_CYCLES * tick / TICK_CYCLES;
    }
    /// The first of its cycles that is not before `at`.
    uint64_t own_cycle(Cycles at) const {
        if (at <= power_up) return 0;
        const Cycles age = at - power_up;
        return age / tick * TICK_CYCLES + (age % tick * TICK_CYCLES + tick - 1) / tick;
    }
};

}  // namespace kilotwin

#endif
