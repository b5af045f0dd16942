/// The bridge from the emulated CAN buses to the world outside (grid/bridge.h), as Python has it.
/// Frames cross as rows of a numpy array.
#ifndef KILOTWIN_PYTHON_BRIDGE_H
#define KILOTWIN_PYTHON_BRIDGE_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Argument of numpy.dtype() for CanRecord: (name, type) of each member, in order.
nanobind::list can_record_fields();

/// Adds the classes Bridge and BridgeError, and CAN_RECORD, to the module.
void register_bridge(nanobind::module_ &m);

}  // namespace kilotwin

#endif
