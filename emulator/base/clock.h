/// The time base: an unsigned count of cycles of 125 ns (the robots' 8 MHz) since the engine's time
/// zero. 64 bits last for 73,000 years.
#ifndef KILOTWIN_BASE_CLOCK_H
#define KILOTWIN_BASE_CLOCK_H

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "kilolib/core/infrared_frame.h"
#include "kilolib/core/timer.h"

namespace kilotwin {

/// A moment, or a span of time.
using Cycles = uint64_t;

/// Later than any moment: of what does not happen.
constexpr Cycles NEVER = std::numeric_limits<Cycles>::max();
/// Those of a chip without oscillator error: 8,000,000.
constexpr Cycles CYCLES_PER_SECOND = 1000 * CYCLES_PER_MS;
/// 32.768 ms, nominal (hardware.md 1.6).
constexpr Cycles TICK_CYCLES = TICK_COUNTS * COUNT_CYCLES;
/// One infrared frame with its last slot, 4.371 ms (hardware.md 1.6).
constexpr Cycles FRAME_CYCLES = FRAME_BYTES * BYTE_SLOTS * SLOT_CYCLES;
/// A cycle and a tick in seconds.
constexpr double CYCLE_S = 1.0 / static_cast<double>(CYCLES_PER_SECOND);
constexpr double TICK_S = static_cast<double>(TICK_CYCLES) * CYCLE_S;

/// The same number, exact below 2^53: 35 years.
constexpr double as_double(Cycles cycles) {
    return static_cast<double>(static_cast<int64_t>(cycles));  // signed: one instruction
}

/// How long `cycles` last, in seconds.
constexpr double seconds(Cycles cycles) { return as_double(cycles) * CYCLE_S; }

// World steps, of 1, 2 or 4 ticks, begin at multiples of their length, which is a power of two.

/// The begin of the step that `at` lies in.
constexpr Cycles begin_of_step(Cycles at, Cycles step) { return at & ~(step - 1); }
/// The first begin of a step not before `at`.
constexpr Cycles end_of_step(Cycles at, Cycles step) { return begin_of_step(at + step - 1, step); }
/// Steps from time zero to the one that `at` lies in.
constexpr size_t number_of_step(Cycles at, Cycles step) { return at >> std::countr_zero(step); }

/// The length of the whole steps within `for_s` seconds, at most 10^12; 0 if negative.
constexpr Cycles whole_steps(double for_s, Cycles step) {
    constexpr auto PER_SECOND = static_cast<double>(CYCLES_PER_SECOND);
    const auto cycles = static_cast<int64_t>(for_s * PER_SECOND);
    return begin_of_step(static_cast<Cycles>(cycles > 0 ? cycles : 0), step);
}

}  // namespace kilotwin

#endif
