/// Layout of the firmware's messages for Python: firmware/aggregation/wire.h owns the
/// bytes, and the host takes them from here.
#ifndef KILOTWIN_PYTHON_WIRE_H
#define KILOTWIN_PYTHON_WIRE_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Adds to the module: WIRE (message types and flags of a cell message by name), CONFIG_KEYS
/// (name: key, preset, least and greatest value) and config_message().
void register_wire(nanobind::module_ &m);

}  // namespace kilotwin

#endif
