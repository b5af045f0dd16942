/// The engine's keyed chance for the host: what a camera does not see, and environments' draws.
#ifndef KILOTWIN_PYTHON_CHANCE_H
#define KILOTWIN_PYTHON_CHANCE_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// uniform() and normal() of base/chance.h, for the host's own purposes: "camera_miss",
/// "camera_x", "camera_y", "camera_heading", "environment". EngineError for any other.
void register_chance(nanobind::module_ &m);

}  // namespace kilotwin

#endif
