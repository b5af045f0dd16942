/// The Kilogrid below a run, as Python has it.
#ifndef KILOTWIN_PYTHON_GRID_H
#define KILOTWIN_PYTHON_GRID_H

#include <nanobind/nanobind.h>

#include "python/simulation.h"

namespace kilotwin {

/// Adds to the class Simulation what concerns cells, modules and CAN buses; each of these methods
/// throws EngineError in a run without a grid.
void register_grid(nanobind::class_<PythonSimulation> &simulation);

}  // namespace kilotwin

#endif
