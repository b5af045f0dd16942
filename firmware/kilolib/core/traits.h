/// Traits of the published kilolib that a robot's runtime has if it is built with KILOLIB_ORIGINAL
/// = 1 (hardware.md 1): it is the runtime of the robots that labs have. Without, it is ours.
///
/// On the chip they cost nothing where they are off. A driver that serves robots of both kinds asks
/// each robot's program which it is. All pure, constant time.
#ifndef KILOLIB_CORE_TRAITS_H
#define KILOLIB_CORE_TRAITS_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration.h"
#include "lights.h"
#include "message.h"
#include "robot_query.h"

#ifndef KILOLIB_ORIGINAL
#define KILOLIB_ORIGINAL 0
#endif

/// So many cycles more the original's function takes on the chip than ours (hardware.md 1.14).
#if KILOLIB_ORIGINAL && defined(__AVR__)
#define ORIGINAL_TAKES_LONGER(cycles) __builtin_avr_delay_cycles(cycles)
#else
#define ORIGINAL_TAKES_LONGER(cycles) ((void)0)
#endif

/// In IDLE and CHARGING the original looks at the state when a blink is over: so long after the
/// state was entered, of a command that comes `cycles_in_state` after that. Cycles of 125 ns.
static inline uint64_t original_looks_after(uint64_t cycles_in_state) {
    return (cycles_in_state / BLINK_PERIOD_CYCLES + 1) * BLINK_PERIOD_CYCLES;
}

/// Whether the original knows a command: no question of ours. A mark in a CALIB says nothing to it
/// and is taken off.
static inline bool original_knows(message_t *command) {
    if (command->type == CALIB) command->data[CALIB_MARK] = 0;
    return command->type < BOOTPGM_CRC;
}

#endif
