/// Registers that drive motors and LED, as a guest's program sets them.
#ifndef KILOTWIN_ROBOTS_NATIVE_OUTPUTS_H
#define KILOTWIN_ROBOTS_NATIVE_OUTPUTS_H

#include "robots/native/abi.h"
#include "robots/record.h"

namespace kilotwin {

/// Takes the registers of a robot as they are now, at its time run up to: drives its motors and its
/// LED if they have changed.
void take_outputs(RobotRecord &robot, const kt_outputs_t &outputs);

}  // namespace kilotwin

#endif
