/// One run as Python holds it: the class kilotwin._emulator.Simulation.
#ifndef KILOTWIN_PYTHON_SIMULATION_H
#define KILOTWIN_PYTHON_SIMULATION_H

#include <nanobind/nanobind.h>

#include <memory>

#include "simulation/simulation.h"

namespace kilotwin {

/// A simulation and what it was made from: the engine keeps no names of programs.
struct PythonSimulation {
    /// Throws EngineError for a specification that the engine cannot run (specification.h).
    PythonSimulation(const nanobind::dict &spec, bool powered);

    /// Loads the programs and boots the robots, once. EngineError as of Simulation's constructor.
    void power_up();

    /// Nominal ticks since RUN; before it is powered up, where it will begin.
    int64_t tick() const;

    /// EngineError before it is powered up.
    Simulation &simulation() const;

    SimulationDef def;  ///< as given

  private:
    std::unique_ptr<Simulation> simulation_;
};

/// Adds the class Simulation to the module. Its objects belong to one thread at a time; advance()
/// gives up the interpreter's lock, everything else is short and keeps it.
void register_simulation(nanobind::module_ &m);

}  // namespace kilotwin

#endif
