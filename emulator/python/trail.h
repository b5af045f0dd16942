/// The trail of a run in Python: methods of Simulation (robots/trail.h).
#ifndef KILOTWIN_PYTHON_TRAIL_H
#define KILOTWIN_PYTHON_TRAIL_H

#include <nanobind/nanobind.h>

#include "python/simulation.h"

namespace kilotwin {

/// Adds keep_trail(), arrivals() and trail().
void register_trail(nanobind::class_<PythonSimulation> &simulation);

}  // namespace kilotwin

#endif
