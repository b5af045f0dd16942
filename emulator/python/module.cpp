// The engine as the Python module kilotwin._emulator: constants, and one file per subject. Find a
// binding in the file that has its subject's name; specification.cpp reads experiments.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "base/errors.h"
#include "physics/contact/box2d_solver.h"
#include "python/bridge.h"
#include "python/chance.h"
#include "python/chip.h"
#include "python/differential_test.h"
#include "python/process.h"
#include "python/programmer.h"
#include "python/simulation.h"
#include "python/wire.h"
#include "robots/native/abi.h"

namespace nb = nanobind;
using namespace kilotwin;

NB_MODULE(_emulator, m) {
    m.doc() = "Kilotwin's engine: many robots, each running its unedited program, in one world.";
    m.attr("TICK_S") = TICK_S;
    m.attr("GUEST_ABI") = KT_GUEST_ABI;
    m.attr("BOX2D_VERSION") = box2d_version();
    m.attr("VERSION") = KILOTWIN_VERSION;
    m.attr("BUILD") = KILOTWIN_BUILD;
    const nb::exception<EngineError> registered(m, "EngineError", PyExc_ValueError);
    register_wire(m);
    register_bridge(m);
    register_chance(m);
    register_chip(m);
    register_differential_test(m);
    register_process(m);
    register_programmer(m);
    register_simulation(m);
}
