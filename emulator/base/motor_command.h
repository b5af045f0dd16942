/// What a robot's program orders of its motors. Made by guest/robot.h and by chips on boards, taken
/// by physics/bodies.h.
#ifndef KILOTWIN_BASE_MOTOR_COMMAND_H
#define KILOTWIN_BASE_MOTOR_COMMAND_H

#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

/// From `at` on the motors have these duties: 0 (off) to 255, as written to the PWM registers.
struct MotorCommand {
    Cycles at;
    uint8_t left, right;
};

}  // namespace kilotwin

#endif
