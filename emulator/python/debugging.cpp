#include "python/debugging.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>
#include <unistd.h>

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/registers.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

const char *name_of(Debugging::Why why) {
    switch (why) {
    case Debugging::Why::STEP: return "step";
    case Debugging::Why::PLACE: return "place";
    case Debugging::Why::BREAKPOINT: return "breakpoint";
    case Debugging::Why::WATCH: return "watch";
    case Debugging::Why::MESSAGE: return "message";
    case Debugging::Why::COLOUR: return "colour";
    case Debugging::Why::CRASH: return "crash";
    default: return "nothing";
    }
}

Debugging::Wanted wanted_of(const nb::dict &wanted) {
    Debugging::Wanted out;
    out.breakpoints = nb::cast<std::vector<uint32_t>>(wanted["breakpoints"]);
    for (const auto &[address, bytes] :
         nb::cast<std::vector<std::pair<uint16_t, uint16_t>>>(wanted["watches"])) {
        if (address + size_t{bytes} > atmega328p::SRAM_END)
            throw EngineError("a watch beyond the end of SRAM");
        out.watches.push_back({address, bytes});
    }
    out.step = nb::cast<bool>(wanted["step"]);
    out.message = nb::cast<bool>(wanted["message"]);
    out.colour = nb::cast<std::optional<uint8_t>>(wanted["colour"]);
    out.only_notes = nb::cast<bool>(wanted["only_notes"]);
    const auto until = nb::cast<std::optional<std::pair<uint32_t, uint64_t>>>(wanted["until"]);
    if (until) out.until = {until->first, until->second};
    return out;
}

nb::object chip_of(const PythonSimulation &self, uint32_t robot) {
    const Driver::Standing now = self.simulation().standing(robot);
    uint8_t status = 0;
    for (unsigned flag = 0; flag < 8; flag++)
        status = static_cast<uint8_t>(status | now.flags[flag] << flag);
    nb::dict out;
    out["data"] = nb::bytes(now.data, atmega328p::SRAM_END);
    out["status"] = status;
    out["pc"] = now.pc;
    out["cycle"] = now.cycle;
    out["at_s"] = self.simulation().seconds_of(self.simulation().moment_of(robot, now.cycle));
    return out;
}

void register_written(nb::class_<PythonSimulation> &simulation) {
    simulation
        .def(
            "note_written",
            [](PythonSimulation &self, uint32_t robot) { self.simulation().note_written(robot); },
            nb::arg("robot"),
            "From now on it is noted which bytes of its SRAM change. Between two steps.")
        .def(
            "take_written",
            [](PythonSimulation &self) {
                const auto written = self.simulation().take_written();
                nb::list out;
                for (size_t at = 0; at < written.size(); at++)
                    if (written[at]) out.append(at);
                return out;
            },
            "Addresses of bytes that may have changed since the last call: written_bytes.h.");
}

}  // namespace

void register_debugging(nb::class_<PythonSimulation> &simulation) {
    register_written(simulation);
    simulation
        .def(
            "hold",
            [](PythonSimulation &self, const std::vector<uint32_t> &robots,
               const nb::callable &on_stop) {
                self.simulation().hold(robots, [on_stop](const Debugging::Stop &stop) {
                    const nb::gil_scoped_acquire lock;
                    try {
                        nb::dict out;
                        out["robot"] = stop.place.robot;
                        out["cycle"] = stop.place.cycle;
                        out["pc"] = stop.pc;
                        out["why"] = name_of(stop.why);
                        out["watch"] = stop.watch;
                        out["before"] = stop.before;
                        on_stop(out);
                    } catch (nb::python_error &error) {
                        // An exception cannot unwind code of robots, which catches none.
                        error.restore();
                        PyErr_Print();
                        _exit(1);
                    }
                });
            },
            nb::arg("robots"), nb::arg("on_stop"),
            "A debugger takes hold of these, which run translated, and lets go of all others. "
            "Between two steps. `on_stop` is called in the midst of advance().")
        .def(
            "want",
            [](PythonSimulation &self, const nb::dict &wanted) {
                self.simulation().debugging().want(wanted_of(wanted));
            },
            nb::arg("wanted"), "What is wanted of robots that are held: see debugging.h.")
        .def("found",
             [](const PythonSimulation &self) -> nb::object {
                 const auto last = self.simulation().found();
                 if (!last) return nb::none();
                 nb::dict out;
                 out["robot"] = last->place.robot;
                 out["cycle"] = last->place.cycle;
                 out["why"] = name_of(last->why);
                 out["watch"] = last->watch;
                 return out;
             })
        .def("chip", chip_of, nb::arg("robot"), "Its data space, status, pc, cycle, at_s.")
        .def(
            "own_cycle",
            [](const PythonSimulation &self, uint32_t robot, double at_s) {
                return self.simulation().own_cycle(robot, at_s);
            },
            nb::arg("robot"), nb::arg("at_s"), "The robot's cycle at a moment since t = 0.")
        .def(
            "tick_of",
            [](const PythonSimulation &self, uint32_t robot, uint64_t cycle) {
                const Simulation &all = self.simulation();
                return all.tick_of(all.moment_of(robot, cycle));
            },
            nb::arg("robot"), nb::arg("cycle"), "The nominal tick of a robot's cycle.");
}

}  // namespace kilotwin
