/// The robot's state on the chip. Commands change it by interrupt; kilo_start() acts on it.
#ifndef KILOLIB_AVR_ROBOT_H
#define KILOLIB_AVR_ROBOT_H

#include "../core/robot_commands.h"

/// Written with interrupts off only.
extern robot_core_t kilolib_robot;
extern robot_heard_t kilolib_heard;

/// The state at present: each call reads it anew.
static inline robot_state_t kilolib_state(void) {
    return (robot_state_t) * (const volatile uint8_t *)&kilolib_robot.state;
}

#endif
