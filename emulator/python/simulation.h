/// One run as Python holds it: the class kilotwin._emulator.Simulation.
#ifndef KILOTWIN_PYTHON_SIMULATION_H
#define KILOTWIN_PYTHON_SIMULATION_H

#include <nanobind/nanobind.h>

#include "simulation/simulation.h"

namespace kilotwin {

/// A simulation and what it was made from: the engine keeps no names of programs.
struct PythonSimulation {
    /// Throws EngineError for a specification that the engine cannot run (specification.h).
    explicit PythonSimulation(const nanobind::dict &spec);

    SimulationDef def;  ///< as given
    Simulation simulation;
};

/// Adds the class Simulation to the module. Its objects belong to one thread at a time; advance()
/// gives up the interpreter's lock, everything else is short and keeps it.
void register_simulation(nanobind::module_ &m);

}  // namespace kilotwin

#endif
