/// Robots that a debugger holds, as Python asks for them.
#ifndef KILOTWIN_PYTHON_DEBUGGING_H
#define KILOTWIN_PYTHON_DEBUGGING_H

#include <nanobind/nanobind.h>

#include "python/simulation.h"

namespace kilotwin {

/// Adds that to the class Simulation.
void register_debugging(nanobind::class_<PythonSimulation> &simulation);

}  // namespace kilotwin

#endif
