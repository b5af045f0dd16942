#include "python/simulation.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "python/arrays.h"
#include "python/debugging.h"
#include "python/grid.h"
#include "python/specification.h"
#include "python/trail.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

// [samples, robots] and [samples, objects] arrays, and the tick of each sample. Takes the vectors
// over: no copy.
nb::dict to_python(Samples samples, size_t robots, size_t objects) {
    nb::dict out;
    out["tick"] = array_of(std::move(samples.tick));
    out["x_m"] = array_of(std::move(samples.x_m), robots);
    out["y_m"] = array_of(std::move(samples.y_m), robots);
    out["heading_rad"] = array_of(std::move(samples.heading_rad), robots);
    out["led"] = array_of(std::move(samples.led), robots);
    out["site"] = array_of(std::move(samples.site), robots);
    // None of what was not asked for.
    if (!samples.left_duty.empty()) {
        out["left_duty"] = array_of(std::move(samples.left_duty), robots);
        out["right_duty"] = array_of(std::move(samples.right_duty), robots);
    }
    if (!samples.battery.empty()) out["battery"] = array_of(std::move(samples.battery), robots);
    if (!samples.sent.empty()) {
        out["sent"] = array_of(std::move(samples.sent), robots);
        out["received"] = array_of(std::move(samples.received), robots);
        out["delivered"] = array_of(std::move(samples.delivered), robots);
    }
    out["object_x_m"] = array_of(std::move(samples.object_x_m), objects);
    out["object_y_m"] = array_of(std::move(samples.object_y_m), objects);
    out["object_heading_rad"] = array_of(std::move(samples.object_heading_rad), objects);
    return out;
}

// A dict per event. `tick` is nominal and counts from RUN, `robot_tick` is the robot's kilo_ticks.
nb::list to_python(const Simulation &simulation, const Events &events) {
    nb::list out;
    for (const auto &event : events) {
        nb::dict row;
        row["tick"] = simulation.tick_of(event.at);
        row["robot_tick"] = event.tick;
        row["robot"] = event.robot;
        describe(row, event);
        out.append(row);
    }
    return out;
}

// Counts since the begin. Overlaps are given as shares of a diameter and in m.
nb::dict to_python(const Statistics &statistics, double diameter_m) {
    nb::dict out;
    out["steps"] = statistics.steps;
    out["frames_sent"] = statistics.medium.sent;
    out["frames_received"] = statistics.medium.received;
    if (statistics.delivered) out["frames_delivered"] = *statistics.delivered;
    out["frames_spoilt"] = statistics.medium.wrong_crc;
    out["attempts_failed"] = statistics.medium.attempts_failed;
    out["frames_collided"] = statistics.medium.collided;
    out["frames_deaf"] = statistics.medium.deaf;
    out["frames_lost"] = statistics.medium.lost;
    out["frames_from_above"] = statistics.medium.above_sent;
    out["received_from_above"] = statistics.medium.above_received;
    out["reached_from_above"] = statistics.medium.above_reached;
    out["solver_steps"] = statistics.solver_steps;
    out["island_steps"] = statistics.island_steps;
    out["list_rebuilds"] = statistics.list_rebuilds;
    out["contacts"] = statistics.overlaps.contacts();
    out["worst_overlap_fraction"] = statistics.overlaps.worst();
    out["median_overlap_fraction"] = statistics.overlaps.median();
    out["worst_overlap_m"] = statistics.overlaps.worst() * diameter_m;
    out["median_overlap_m"] = statistics.overlaps.median() * diameter_m;
    return out;
}

// A hash as 16 hexadecimal digits, the form in which manifests and tables keep it: JSON has no
// whole numbers of 64 bits.
std::string digits_of(uint64_t hash) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
    return text;
}

// Indices come from Python: -1 is not the last robot, and none is beyond the end.
const Robot &robot_of(const PythonSimulation &self, size_t robot) {
    if (robot >= self.simulation().size())
        throw EngineError("there is no robot " + std::to_string(robot));
    return self.simulation().robot(robot);
}

// Path of a robot's guest, or of its image.
std::string program_of(const PythonSimulation &self, size_t robot) {
    return robot_of(self, robot).driver().path();
}

// [N, 2]: duties of the left and the right motor, 0 to 255.
nb::object motors_of(const PythonSimulation &self) {
    std::vector<uint8_t> duties;
    for (size_t i = 0; i < self.simulation().size(); i++) {
        duties.push_back(self.simulation().robot(i).left_duty());
        duties.push_back(self.simulation().robot(i).right_duty());
    }
    return array_of(std::move(duties), 2);
}

// [N, 2]: frames sent and received since the begin.
nb::object frames_of(const PythonSimulation &self) {
    std::vector<uint32_t> counts;
    for (const FrameCounts &robot : self.simulation().frames()) {
        counts.push_back(robot.sent);
        counts.push_back(robot.received);
    }
    return array_of(std::move(counts), 2);
}

nb::object decisions_of(const PythonSimulation &self) {
    std::vector<uint32_t> counts;
    for (size_t i = 0; i < self.simulation().size(); i++)
        counts.push_back(self.simulation().robot(i).decisions());
    return array_of(std::move(counts));
}

// By robot.
nb::object hummed_of(const PythonSimulation &self) {
    std::vector<double> hummed;
    for (uint32_t i = 0; i < self.simulation().size(); i++)
        hummed.push_back(self.simulation().hummed_s(i));
    return array_of(std::move(hummed));
}

// A reception is (tick since RUN, nine data bytes and the type, distance in mm).
nb::list heard_by(const PythonSimulation &self, uint32_t robot) {
    nb::list out;
    for (const Heard &heard : self.simulation().heard_by(robot)) {
        const auto *bytes = reinterpret_cast<const char *>(&heard.message);
        out.append(nb::make_tuple(self.simulation().tick_of(heard.at),
                                  nb::bytes(bytes, offsetof(message_t, crc)), heard.distance_mm));
    }
    return out;
}

// The bytes of a guest's variables, as its program has laid them out.
nb::bytes state_of(const PythonSimulation &self, size_t robot) {
    auto bytes = robot_of(self, robot).variables();
    return nb::bytes(bytes.data(), bytes.size());
}

using Class = nb::class_<PythonSimulation>;

// advance() is the only method that takes long: it gives up the interpreter's lock.
void register_stepping(Class &simulation) {
    simulation
        .def(nb::init<const nb::dict &, bool>(), nb::arg("spec"), nb::kw_only(),
             nb::arg("powered") = true)
        .def("power_up", &PythonSimulation::power_up,
             "Load the programs and boot the robots, of one that was made with powered=False.")
        .def(
            "advance",
            [](PythonSimulation &self, int64_t ticks) { self.simulation().advance(ticks); },
            nb::arg("ticks"), nb::call_guard<nb::gil_scoped_release>(),
            "Go on by at least `ticks`, to the end of a world step.")
        .def(
            "send",
            [](PythonSimulation &self, const nb::bytes &message, uint16_t first, uint16_t last,
               const nb::object &region) {
                self.simulation().send(command_of(message, first, last, region));
            },
            nb::arg("message"), nb::arg("uid_first") = 0, nb::arg("uid_last") = 65535,
            nb::arg("region").none() = nb::none(),
            "Give robots a message now: nine data bytes and a type.")
        .def(
            "place",
            [](PythonSimulation &self, size_t robot, double x_m, double y_m, double heading_rad) {
                self.simulation().place(robot, {{x_m, y_m}, heading_rad});
            },
            nb::arg("robot"), nb::arg("x_m"), nb::arg("y_m"), nb::arg("heading_rad"),
            "Take a robot away to a pose. EngineError where it has no room.")
        .def(
            "turn",
            [](PythonSimulation &self, size_t robot, double heading_rad) {
                self.simulation().turn(robot, heading_rad);
            },
            nb::arg("robot"), nb::arg("heading_rad"), "Turn a robot where it stands.")
        .def(
            "shine",
            [](PythonSimulation &self, const nb::bytes &frame, double after_s,
               uint32_t controller) {
                if (!(after_s >= 0)) throw EngineError("a frame cannot begin in the past");
                const auto after = static_cast<Cycles>(after_s * double{CYCLES_PER_SECOND});
                self.simulation().shine_from_above(frame_of(frame), self.simulation().now() + after,
                                                   controller);
            },
            nb::arg("frame"), nb::arg("after_s"), nb::arg("controller") = 0,
            "An overhead controller's frame begins so much later: 12 bytes, CRC included.")
        .def(
            "set_ambient",
            [](PythonSimulation &self, double reading) { self.simulation().set_ambient(reading); },
            nb::arg("reading"), "Ambient light from now on.")
        .def(
            "set_peak",
            [](PythonSimulation &self, size_t lamp, double reading) {
                self.simulation().set_peak(lamp, reading);
            },
            nb::arg("lamp"), nb::arg("reading"), "What a lamp adds right below it, from now on.");
}

// samples() and events() hand over what has come since the last call; the others change nothing.
void register_results(Class &simulation) {
    simulation.def_prop_ro("tick", &PythonSimulation::tick)
        .def_prop_ro("robots",
                     [](const PythonSimulation &self) { return self.simulation().size(); })
        .def("samples",
             [](PythonSimulation &self) {
                 return to_python(self.simulation().take_samples(), self.simulation().size(),
                                  self.simulation().objects());
             })
        .def("snapshot",
             [](PythonSimulation &self) {
                 return to_python(self.simulation().snapshot(), self.simulation().size(),
                                  self.simulation().objects());
             })
        .def(
            "close_look",
            [](PythonSimulation &self) {
                return to_python(self.simulation().snapshot({true, true, true}),
                                 self.simulation().size(), self.simulation().objects());
            },
            "A snapshot with motors, batteries and counts of messages, whatever samples have.")
        .def("events",
             [](PythonSimulation &self) {
                 return to_python(self.simulation(), self.simulation().take_events());
             })
        .def(
            "result_hash",
            [](PythonSimulation &self) { return digits_of(self.simulation().result_hash()); },
            "16 hex digits over every sample, prints, failures and counts of frames up to now.")
        .def(
            "final_hash",
            [](const PythonSimulation &self) {
                return digits_of(final_hash(self.simulation().snapshot()));
            },
            "16 hex digits over poses and LEDs as they are now.")
        .def("stats", [](const PythonSimulation &self) {
            return to_python(self.simulation().statistics(), 2 * self.def.profile.radius_m);
        });
}

// Single robots; each throws EngineError for an index that is none.
void register_robots(Class &simulation) {
    simulation.def("motors", motors_of)
        .def("frames", frames_of, "[N, 2]: sent and received.")
        .def("decisions", decisions_of, "[N]: times that LED or motors have changed.")
        .def(
            "listen_to",
            [](PythonSimulation &self, const std::vector<uint32_t> &robots) {
                self.simulation().listen_to(robots);
            },
            nb::arg("robots"), "Write down what programs of these robots get from now on.")
        .def("heard_by", heard_by, nb::arg("robot"), "What it got, up to now.")
        .def("hummed_s", hummed_of, "[N]: how long motors were on while neither turned.")
        .def("state", state_of, nb::arg("robot"))
        .def("program", program_of, nb::arg("robot"))
        .def(
            "trace",
            [](PythonSimulation &self, size_t robot, const std::string &path) {
                self.simulation().trace(robot, path);
            },
            nb::arg("robot"), nb::arg("path"),
            "Write what the pins of a robot on a board do from now on to a VCD file.");
}

}  // namespace

PythonSimulation::PythonSimulation(const nb::dict &spec, bool powered) : def(definition_of(spec)) {
    if (powered) power_up();
}

void PythonSimulation::power_up() { simulation_ = std::make_unique<Simulation>(def); }

int64_t PythonSimulation::tick() const {
    return simulation_ ? simulation_->tick() : Simulation::first_tick(def);
}

Simulation &PythonSimulation::simulation() const {
    if (!simulation_) throw EngineError("the simulation is not powered up");
    return *simulation_;
}

// One class in parts, so that each part can be read at once.
void register_simulation(nb::module_ &m) {
    Class simulation(m, "Simulation", "One run; see emulator/simulation/simulation.h.");
    register_stepping(simulation);
    register_results(simulation);
    register_robots(simulation);
    register_grid(simulation);
    register_trail(simulation);
    register_debugging(simulation);
}

}  // namespace kilotwin
