/// Timer 0 of robots and modules, and what sending by infrared costs them (hardware.md 1.6, 1.7).
#ifndef KILOTWIN_ROBOTS_TIMER_H
#define KILOTWIN_ROBOTS_TIMER_H

#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

/// From an attempt's start pulse to the end of listening, when it finds the channel busy.
constexpr Cycles SENSE_CYCLES = LEADER_REST_SLOTS * SLOT_CYCLES + LEADER_POLLS * POLL_CYCLES;
constexpr uint32_t RAND_HARD_CYCLES = CYCLES_PER_SECOND / 2000;

/// Time of a robot or a module.
struct GuestTime {
    Cycles now;                ///< the time run up to
    Cycles until = 0;          ///< end of the run that goes on
    Cycles tick_length;        ///< of a tick, by its own oscillator
    Cycles next_tick = NEVER;  ///< compare match of timer 0
};

}  // namespace kilotwin

#endif
