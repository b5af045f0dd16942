/// A resolved experiment, as the host hands it over, read into the engine's own structures.
///
/// The specification is a plain dictionary. Its schema, its defaults and the error messages that a
/// user reads are the host's (host_tools/kilotwin/experiment); what is wrong here is a mistake of
/// the host and throws EngineError, or nanobind's cast error for a value of the wrong type. All of
/// these read Python objects and need the interpreter's lock.
#ifndef KILOTWIN_PYTHON_SPECIFICATION_H
#define KILOTWIN_PYTHON_SPECIFICATION_H

#include <nanobind/nanobind.h>

#include <string>

#include "robots/tier.h"
#include "simulation/simulation.h"

namespace kilotwin {

/// The whole run. Lengths are in m, angles in rad, times in ticks or s, as the keys say.
SimulationDef definition_of(const nanobind::dict &from);

/// A tier by its word: native, translated, chip or interpreted.
Tier tier_of(const std::string &word);

/// A message without its CRC: nine data bytes and the type, no more and no fewer.
message_t message_of(const nanobind::bytes &bytes);

/// A message with its CRC, 12 bytes.
message_t frame_of(const nanobind::bytes &bytes);

/// A message from outside the medium to the robots with a uid in the range, both ends included.
/// `region` is None (everywhere) or (x_m, y_m, radius_m). The command's tick is 0.
SimulationDef::Command command_of(const nanobind::bytes &message, uint16_t uid_first,
                                  uint16_t uid_last, nanobind::handle region);

}  // namespace kilotwin

#endif
