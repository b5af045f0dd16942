/// Timer 0 of robots and modules, and what sending by infrared costs them (hardware.md 1.6, 1.7).
#ifndef KILOTWIN_GUEST_TIMER_H
#define KILOTWIN_GUEST_TIMER_H

#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

/// Timer 0's compare value, and what an ordinary tick adds to the clock of transmissions.
constexpr uint16_t TICK_COMPARE = 255;
constexpr Cycles COUNT_CYCLES = 1024;  ///< a count of timer 0
constexpr Cycles SENSE_CYCLES =
    2418;  ///< an attempt that finds the channel busy: 2 slots, 235 polls
constexpr uint32_t RAND_HARD_CYCLES = CYCLES_PER_SECOND / 2000;

}  // namespace kilotwin

#endif
