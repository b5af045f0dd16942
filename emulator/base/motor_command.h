/// A robot's motors as its program sets them. Made by robots/robot.h and by chips on boards, taken
/// by physics/bodies.h.
#ifndef KILOTWIN_BASE_MOTOR_COMMAND_H
#define KILOTWIN_BASE_MOTOR_COMMAND_H

#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

/// One order for both motors: from `at` on they have these duties, 0 (off) to 255, as written to
/// the PWM registers. Holds until the next one.
struct MotorCommand {
    Cycles at;            ///< world time
    uint8_t left, right;  ///< duties
};

}  // namespace kilotwin

#endif
