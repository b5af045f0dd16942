/// Durations of a module's runtime in cycles: those of the core (kilogrid_modules/runtime/core) in
/// the engine's time base.
#ifndef KILOTWIN_MODULES_TIMING_H
#define KILOTWIN_MODULES_TIMING_H

#include "base/clock.h"
#include "robots/timer.h"
#include "runtime/core/answers.h"
#include "runtime/core/light_patterns.h"
#include "runtime/core/turns.h"

namespace kilotwin {

/// A millisecond.
constexpr Cycles MS = CYCLES_PER_MS;

/// Dwell of the receiver on a cell.
constexpr Cycles DWELL_CYCLES = TURNS_DWELL_UNITS * COUNT_CYCLES;

/// Length of module_init(), which shows the lights with interrupts off.
constexpr Cycles SHOW_STEP = SHOW_STEP_MS * MS;
constexpr Cycles INIT_CYCLES = SHOW_STEPS * SHOW_STEP;

/// A pass of the idle module's main loop.
constexpr Cycles BREATH_STEP = BREATH_STEP_MS * MS;

/// Gaps between the frames of an answer to a poll.
constexpr Cycles AFTER_START = ANSWERS_AFTER_START_US * MS / 1000;
constexpr Cycles AFTER_RECORD = ANSWERS_AFTER_RECORD_US * MS / 1000;

/// Receive buffers of the CAN controller.
constexpr uint8_t CONTROLLER_BUFFERS = 2;

}  // namespace kilotwin

#endif
