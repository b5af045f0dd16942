/// Facts that the host takes from the firmware's C: the layout of messages, which
/// firmware/aggregation/wire.h owns, and how robots estimate distances (kilolib/core/gains.h).
#ifndef KILOTWIN_PYTHON_WIRE_H
#define KILOTWIN_PYTHON_WIRE_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Adds to the module: WIRE (message types and flags of a cell message by name), CONFIG_KEYS
/// (name: key, preset, least and greatest value), config_message() and estimate_distances().
void register_wire(nanobind::module_ &m);

}  // namespace kilotwin

#endif
