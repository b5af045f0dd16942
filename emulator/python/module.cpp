// The engine as the Python module kilotwin._emulator. Takes resolved experiments as plain
// dictionaries; the schema and its error messages are the host's
// (host_tools/kilotwin/experiment/).
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstring>
#include <iterator>

#include "aggregation/wire.h"
#include "base/errors.h"
#include "physics/contact/box2d_solver.h"
#include "python/bridge.h"
#include "python/twins.h"
#include "simulation/simulation.h"

namespace nb = nanobind;
using namespace kilotwin;

namespace {

template <typename T> T get(const nb::dict &from, const char *key) {
    if (!from.contains(key)) throw EngineError(std::string("the run's specification lacks ") + key);
    return nb::cast<T>(from[key]);
}

Eigen::Vector2d vector_of(const std::vector<double> &xy) {
    if (xy.size() != 2) throw EngineError("a point has two coordinates");
    return {xy[0], xy[1]};
}

Region region_of(const nb::dict &from, const Eigen::Vector2d &centre) {
    auto shape = get<std::string>(from, "shape");
    if (shape != "circle" && shape != "rectangle")
        throw EngineError("shape is circle or rectangle, not " + shape);
    return {shape == "circle" ? Region::Shape::CIRCLE : Region::Shape::RECTANGLE,
            centre,
            {get<double>(from, "width_m"), get<double>(from, "height_m")}};
}

template <typename T> T get_or(const nb::dict &from, const char *key, T otherwise) {
    return from.contains(key) ? nb::cast<T>(from[key]) : otherwise;
}

SolverKind solver_of(const std::string &name) {
    if (name == "discs") return SolverKind::DISCS;
    if (name == "box2d") return SolverKind::BOX2D;
    throw EngineError("the solver of contacts is discs or box2d, not " + name);
}

Profile profile_of(const nb::dict &from) {
    Profile profile = {get<double>(from, "radius_m"),       get<double>(from, "speed_m_s"),
                       get<double>(from, "turn_rad_s"),     get<double>(from, "push_m_s2"),
                       get<uint8_t>(from, "straight_left"), get<uint8_t>(from, "straight_right"),
                       get<uint8_t>(from, "turn_left"),     get<uint8_t>(from, "turn_right")};
    profile.legs = get_or(from, "legs", profile.legs);
    profile.kick_needed = get_or(from, "kick_needed", profile.kick_needed);
    profile.gives_way = get_or(from, "gives_way", profile.gives_way);
    profile.speed_spread = get_or(from, "speed_spread", profile.speed_spread);
    profile.bias_spread = get_or(from, "bias_spread", profile.bias_spread);
    profile.motor_noise = get_or(from, "motor_noise", profile.motor_noise);
    return profile;
}

/// The medium is "ideal", or "kilobot" with any of its settings.
void set_medium(SimulationDef &def, const nb::dict &from) {
    auto kind = get<std::string>(from, "kind");
    def.range_m = get<double>(from, "range_m");
    if (kind == "ideal") {
        def.line_of_sight = get<bool>(from, "line_of_sight");
        return;
    }
    if (kind != "kilobot") throw EngineError("the medium is ideal or kilobot, not " + kind);
    KilobotMedium::Settings s;
    s.range_m = def.range_m;
    s.range_spread = get_or(from, "range_spread", s.range_spread);
    s.loss = get_or(from, "loss", s.loss);
    s.loss_at_range = get_or(from, "loss_at_range", s.loss_at_range);
    s.gain_noise_lsb = get_or(from, "gain_noise_lsb", s.gain_noise_lsb);
    s.carrier_sense = get_or(from, "carrier_sense", s.carrier_sense);
    s.collisions = get_or(from, "collisions", s.collisions);
    s.half_duplex = get_or(from, "half_duplex", s.half_duplex);
    s.held_busy = get_or(from, "held_busy", s.held_busy);
    def.kilobot_medium = s;
    def.clock_spread = get_or(from, "clock_spread", 0.0);
    def.sensitivity_spread = get_or(from, "sensitivity_spread", 0.0);
}

std::vector<Pose> poses_of(nb::handle from) {
    std::vector<Pose> poses;
    for (nb::handle row : from) {
        auto values = nb::cast<std::vector<double>>(row);
        if (values.size() != 3) throw EngineError("a pose is x_m, y_m, heading_rad");
        poses.push_back({{values[0], values[1]}, values[2]});
    }
    return poses;
}

message_t message_of(const nb::bytes &bytes) {
    if (bytes.size() != WIRE_DATA_BYTES + 1)
        throw EngineError("a message has nine data bytes and a type");
    message_t message = {};
    std::memcpy(&message, bytes.c_str(), WIRE_DATA_BYTES + 1);
    return message;
}

SimulationDef::Command command_of(const nb::bytes &message, uint16_t uid_first, uint16_t uid_last,
                                  nb::handle region) {
    SimulationDef::Command command = {0, uid_first, uid_last, message_of(message)};
    if (region.is_none()) return command;
    auto [x, y, radius] = nb::cast<std::tuple<double, double, double>>(region);
    command.centre = {x, y};
    command.radius_m = radius;
    return command;
}

Light light_of(const nb::dict &from) {
    Light light;
    light.ambient = get<double>(from, "ambient");
    for (nb::handle item : get<nb::list>(from, "sources")) {
        auto source = nb::cast<nb::dict>(item);
        light.sources.push_back({vector_of(get<std::vector<double>>(source, "at_m")),
                                 get<double>(source, "peak"), get<double>(source, "half_m")});
    }
    return light;
}

Grid::Fault fault_of(const nb::dict &from) {
    static const std::pair<const char *, Grid::Fault::Kind> KINDS[] = {
        {"dead", Grid::Fault::Kind::DEAD},
        {"reset", Grid::Fault::Kind::RESET},
        {"bus_off", Grid::Fault::Kind::BUS_OFF},
        {"recover", Grid::Fault::Kind::RECOVER}};
    const auto name = get<std::string>(from, "kind");
    const auto *kind = std::find_if(std::begin(KINDS), std::end(KINDS),
                                    [&](const auto &known) { return name == known.first; });
    if (kind == std::end(KINDS))
        throw EngineError("a fault is dead, reset, bus_off or recover, not " + name);
    const auto module = get<std::vector<uint32_t>>(from, "module");
    if (module.size() != 2) throw EngineError("a module is named by column and row");
    return {get<int64_t>(from, "at_tick"), kind->second, module[0], module[1]};
}

Grid::Settings grid_of(const nb::dict &from) {
    Grid::Settings grid;
    grid.columns = get<uint32_t>(from, "columns");
    grid.rows = get<uint32_t>(from, "rows");
    grid.buses = get<uint32_t>(from, "buses");
    grid.program = get<std::string>(from, "program");
    grid.name = get<std::string>(from, "name");
    grid.on_board = get_or(from, "on_board", grid.on_board);
    grid.error_share = get_or(from, "error_share", grid.error_share);
    if (from.contains("modules") && !from["modules"].is_none()) {
        auto own = get<nb::dict>(from, "modules");
        CellInfrared &s = grid.infrared;
        s.cell_range_m = get_or(own, "cell_range_m", s.cell_range_m);
        s.robot_range_m = get_or(own, "robot_range_m", s.robot_range_m);
        s.weak_share = get_or(own, "weak_share", s.weak_share);
        s.weak_range_m = get_or(own, "weak_range_m", s.weak_range_m);
        s.weak_spell_s = get_or(own, "weak_spell_s", s.weak_spell_s);
        s.loss = get_or(own, "loss", s.loss);
        s.clock_spread = get_or(own, "clock_spread", s.clock_spread);
    }
    if (from.contains("faults"))
        for (nb::handle item : get<nb::list>(from, "faults"))
            grid.faults.push_back(fault_of(nb::cast<nb::dict>(item)));
    return grid;
}

SimulationDef definition_of(const nb::dict &spec) {
    SimulationDef def;
    def.seed = get<uint64_t>(spec, "seed");
    def.step_ticks = get<uint32_t>(spec, "step_ticks");
    def.arena.bounds = region_of(get<nb::dict>(spec, "arena"), {0, 0});
    for (nb::handle site : get<nb::list>(spec, "sites")) {
        auto from = nb::cast<nb::dict>(site);
        def.arena.sites.push_back(
            region_of(from, vector_of(get<std::vector<double>>(from, "centre_m"))));
    }
    def.profile = profile_of(get<nb::dict>(spec, "profile"));
    def.solver = solver_of(get<std::string>(spec, "contact_solver"));
    if (!spec["floor"].is_none()) {
        auto floor = get<nb::dict>(spec, "floor");
        def.floor = VirtualFloor::Settings{get<double>(floor, "obstacle_m"),
                                           get<uint32_t>(floor, "step_ticks"),
                                           get<uint32_t>(floor, "repeat_ticks")};
    }
    set_medium(def, get<nb::dict>(spec, "medium"));
    for (nb::handle item : get<nb::list>(spec, "groups")) {
        auto from = nb::cast<nb::dict>(item);
        SimulationDef::Group group = {get<std::string>(from, "program"),
                                      get<std::string>(from, "name"),
                                      get<size_t>(from, "count"),
                                      {}};
        if (!from["poses"].is_none()) group.poses = poses_of(from["poses"]);
        group.on_board = get_or(from, "on_board", false);
        if (!group.poses.empty() && group.poses.size() != group.count)
            throw EngineError("a group has as many poses as robots, or none");
        def.groups.push_back(std::move(group));
    }
    for (nb::handle item : get<nb::list>(spec, "commands")) {
        auto fields = nb::cast<nb::tuple>(item);
        if (fields.size() != 5)
            throw EngineError("a command is tick, uid_first, uid_last, message, region");
        auto command = command_of(nb::cast<nb::bytes>(fields[3]), nb::cast<uint16_t>(fields[1]),
                                  nb::cast<uint16_t>(fields[2]), fields[4]);
        command.tick = nb::cast<int64_t>(fields[0]);
        def.commands.push_back(command);
    }
    if (spec.contains("grid") && !spec["grid"].is_none())
        def.grid = grid_of(get<nb::dict>(spec, "grid"));
    def.lead_ticks = get_or(spec, "lead_ticks", def.lead_ticks);
    if (spec.contains("light") && !spec["light"].is_none())
        def.light = light_of(get<nb::dict>(spec, "light"));
    def.battery_h = get_or(spec, "battery_h", def.battery_h);
    def.temperature = get_or(spec, "temperature", def.temperature);
    def.sample_ticks = get<uint32_t>(spec, "sample_ticks");
    if (spec.contains("black_box") && !spec["black_box"].is_none())
        def.black_box = get<std::string>(spec, "black_box");
    if (spec.contains("run_ahead")) def.run_ahead = get<bool>(spec, "run_ahead");
    return def;
}

/// A numpy array that owns `values`, `columns` wide (0: one dimension).
template <typename T> nb::object array_of(std::vector<T> values, size_t columns) {
    auto owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void *p) noexcept { delete static_cast<std::vector<T> *>(p); });
    if (columns == 0)
        return nb::cast(nb::ndarray<nb::numpy, T>(owned->data(), {owned->size()}, owner));
    return nb::cast(
        nb::ndarray<nb::numpy, T>(owned->data(), {owned->size() / columns, columns}, owner));
}

nb::dict to_python(Samples samples, size_t robots) {
    nb::dict out;
    out["tick"] = array_of(std::move(samples.tick), 0);
    out["x_m"] = array_of(std::move(samples.x_m), robots);
    out["y_m"] = array_of(std::move(samples.y_m), robots);
    out["heading_rad"] = array_of(std::move(samples.heading_rad), robots);
    out["led"] = array_of(std::move(samples.led), robots);
    out["site"] = array_of(std::move(samples.site), robots);
    return out;
}

/// A program may print any bytes.
nb::object text_of(const Event &event) {
    return nb::steal(PyUnicode_DecodeUTF8(
        event.text.data(), static_cast<Py_ssize_t>(event.text.size()), "backslashreplace"));
}

nb::list to_python(const Simulation &simulation, const Events &events) {
    nb::list out;
    for (const auto &event : events) {
        nb::dict row;
        row["tick"] = simulation.tick_of(event.at);
        row["robot_tick"] = event.tick;
        row["robot"] = event.robot;
        row["program"] = event.program;
        row["kind"] = name_of(event.kind);
        row["text"] = text_of(event);
        out.append(row);
    }
    return out;
}

nb::dict to_python(const Statistics &statistics, double diameter_m) {
    nb::dict out;
    out["steps"] = statistics.steps;
    out["frames_sent"] = statistics.medium.sent;
    out["frames_received"] = statistics.medium.received;
    out["frames_spoilt"] = statistics.medium.wrong_crc;
    out["attempts_failed"] = statistics.medium.attempts_failed;
    out["frames_collided"] = statistics.medium.collided;
    out["frames_deaf"] = statistics.medium.deaf;
    out["frames_lost"] = statistics.medium.lost;
    out["solver_steps"] = statistics.solver_steps;
    out["list_rebuilds"] = statistics.list_rebuilds;
    out["contacts"] = statistics.overlaps.contacts();
    out["worst_overlap_fraction"] = statistics.overlaps.worst();
    out["median_overlap_fraction"] = statistics.overlaps.median();
    out["worst_overlap_m"] = statistics.overlaps.worst() * diameter_m;
    out["median_overlap_m"] = statistics.overlaps.median() * diameter_m;
    return out;
}

/// A simulation as Python holds it.
struct PythonSimulation {
    explicit PythonSimulation(const nb::dict &spec) : def(definition_of(spec)), simulation(def) {}
    SimulationDef def;
    Simulation simulation;
};

bool send_can(PythonSimulation &self, uint32_t bus, uint16_t id, const nb::bytes &data) {
    CanFrame frame;
    if (id > CanFrame::ID_MAX) throw EngineError("an identifier has 11 bits");
    if (data.size() > CanFrame::DATA_MAX) throw EngineError("a CAN frame has 8 bytes at most");
    frame.id = id;
    frame.dlc = static_cast<uint8_t>(data.size());
    std::memcpy(frame.data.data(), data.c_str(), data.size());
    return self.simulation.send_can(bus, frame);
}

nb::object can_frames(PythonSimulation &self) {
    std::vector<CanRecord> rows;
    for (const auto &logged : self.simulation.grid().take_frames())
        rows.push_back({self.simulation.seconds_of(logged.at), static_cast<uint8_t>(logged.bus),
                        logged.frame.id, logged.frame.dlc, logged.frame.data, logged.from_host});
    nb::module_ numpy = nb::module_::import_("numpy");
    return numpy.attr("frombuffer")(nb::bytes(rows.data(), rows.size() * sizeof(CanRecord)),
                                    numpy.attr("dtype")(can_record_fields()));
}

/// Colour and brightness of all cells, from the lower left.
nb::object cells_of(PythonSimulation &self) {
    Grid &grid = self.simulation.grid();
    const GridLayout &layout = grid.layout();
    const size_t rows = 2 * layout.rows(), columns = 2 * layout.columns();
    auto *values = new std::vector<uint8_t>();
    nb::capsule owner(values,
                      [](void *p) noexcept { delete static_cast<std::vector<uint8_t> *>(p); });
    Grid::serve_this_thread();
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t column = 0; column < columns; column++) {
            const CellLight light = grid.light(layout.cell(column, row), self.simulation.now());
            values->push_back(light.color());
            values->push_back(light.brightness());
        }
    return nb::cast(
        nb::ndarray<nb::numpy, uint8_t>(values->data(), {rows, columns, size_t{2}}, owner));
}

const char *name_of(CanBus::State state) {
    static const char *const NAMES[] = {"active", "passive", "bus_off", "dead"};
    return NAMES[static_cast<int>(state)];
}

nb::list modules_of(const PythonSimulation &self) {
    const Grid &grid = self.simulation.grid();
    nb::list out;
    for (uint32_t index = 0; index < grid.layout().modules(); index++) {
        const uint32_t on_bus = grid.layout().bus(index), node = grid.node(index);
        const CanBus &bus = grid.bus(on_bus);
        nb::dict row;
        row["x"] = grid.layout().x(index);
        row["y"] = grid.layout().y(index);
        row["bus"] = on_bus;
        const auto &about = grid.about(index);
        row["state"] = about.state;
        row["stopped"] = about.stopped;
        row["tick"] = about.ticks;
        row["can"] = name_of(bus.state(node));
        row["tec"] = bus.transmit_errors(node);
        row["rec"] = bus.receive_errors(node);
        row["frames_refused"] = about.frames_refused;
        row["frames_missed"] = about.frames_missed;
        out.append(row);
    }
    return out;
}

nb::list can_stats(const PythonSimulation &self) {
    const Grid &grid = self.simulation.grid();
    nb::list out;
    for (uint32_t index = 0; index < grid.layout().buses(); index++) {
        const CanBus &bus = grid.bus(index);
        const auto &counts = bus.counts();
        nb::dict row;
        row["load"] = bus.load(self.simulation.now());
        row["frames"] = counts.frames;
        row["error_frames"] = counts.error_frames;
        row["not_acknowledged"] = counts.not_acknowledged;
        row["went_bus_off"] = counts.went_bus_off;
        row["lost_queue_full"] = counts.lost_queue_full;
        row["lost_bus_off"] = counts.lost_bus_off;
        row["lost_dead"] = counts.lost_dead;
        out.append(row);
    }
    return out;
}

nb::dict cell_stats(const PythonSimulation &self) {
    const Grid::Counts &counts = self.simulation.grid().counts;
    nb::dict out;
    out["sent"] = counts.sent;
    out["unheard"] = counts.unheard;
    out["put_off"] = counts.put_off;
    out["received"] = counts.received;
    out["collided"] = counts.collided;
    out["deaf"] = counts.deaf;
    out["elsewhere"] = counts.elsewhere;
    out["lost"] = counts.lost;
    return out;
}

nb::list module_events(PythonSimulation &self) {
    Grid &grid = self.simulation.grid();
    nb::list out;
    for (const auto &event : grid.take_events()) {
        nb::dict row;
        row["tick"] = self.simulation.tick_of(event.at);
        row["module_tick"] = event.tick;
        row["module"] = nb::make_tuple(grid.layout().x(event.robot), grid.layout().y(event.robot));
        row["program"] = event.program;
        row["kind"] = name_of(event.kind);
        row["text"] = text_of(event);
        out.append(row);
    }
    return out;
}

std::string hash_of(const PythonSimulation &self) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx",
                  static_cast<unsigned long long>(result_hash(self.simulation.snapshot())));
    return text;
}

const Robot &robot_of(const PythonSimulation &self, size_t robot) {
    if (robot >= self.simulation.size())
        throw EngineError("there is no robot " + std::to_string(robot));
    return self.simulation.robot(robot);
}

std::string program_of(const PythonSimulation &self, size_t robot) {
    if (!robot_of(self, robot).on_board()) return robot_of(self, robot).program().path();
    for (const auto &group : self.def.groups) {
        if (robot < group.count) return group.program;
        robot -= group.count;
    }
    return {};
}

nb::object motors_of(const PythonSimulation &self) {
    std::vector<uint8_t> duties;
    for (size_t i = 0; i < self.simulation.size(); i++) {
        duties.push_back(self.simulation.robot(i).left_duty());
        duties.push_back(self.simulation.robot(i).right_duty());
    }
    return array_of(std::move(duties), 2);
}

nb::object frames_of(const PythonSimulation &self) {
    std::vector<uint32_t> counts;
    for (const FrameCounts &robot : self.simulation.frames()) {
        counts.push_back(robot.sent);
        counts.push_back(robot.received);
    }
    return array_of(std::move(counts), 2);
}

nb::dict cell_infrared() {
    const CellInfrared defaults;
    nb::dict out;
    out["cell_range_m"] = defaults.cell_range_m;
    out["robot_range_m"] = defaults.robot_range_m;
    out["weak_share"] = defaults.weak_share;
    out["weak_range_m"] = defaults.weak_range_m;
    out["weak_spell_s"] = defaults.weak_spell_s;
    out["loss"] = defaults.loss;
    out["clock_spread"] = defaults.clock_spread;
    return out;
}

nb::dict config_keys() {
    nb::dict keys;
#define ADD_KEY(name, key, preset, least, most)                                   \
    keys[#name] = nb::make_tuple(key##u, preset##u, static_cast<uint32_t>(least), \
                                 static_cast<uint32_t>(most));
    WIRE_CONFIG_KEYS(ADD_KEY)
#undef ADD_KEY
    return keys;
}

nb::bytes config_message(uint16_t uid_first, uint16_t uid_last, uint8_t key, uint32_t value) {
    uint8_t bytes[WIRE_DATA_BYTES + 1];
    wire_put_config(bytes, {uid_first, uid_last, key, value});
    bytes[WIRE_DATA_BYTES] = WIRE_TYPE_CONFIG;
    return nb::bytes(bytes, sizeof bytes);
}

}  // namespace

NB_MODULE(_emulator, m) {
    m.doc() = "Kilotwin's engine: many robots, each running its unedited program, in one world.";
    m.attr("TICK_S") = TICK_S;
    m.attr("GUEST_ABI") = KT_GUEST_ABI;
    m.attr("BOX2D_VERSION") = box2d_version();
    m.attr("VERSION") = KILOTWIN_VERSION;
    m.attr("BUILD") = KILOTWIN_BUILD;
    m.attr("CONFIG_KEYS") = config_keys();
    m.attr("CELL_INFRARED") = cell_infrared();
    nb::dict wire;
    wire["TYPE_CELL"] = int(WIRE_TYPE_CELL);
    wire["TYPE_SIGNAL"] = int(WIRE_TYPE_SIGNAL);
    wire["TYPE_CONFIG"] = int(WIRE_TYPE_CONFIG);
    wire["CELL_WALL"] = WIRE_CELL_WALL;
    wire["CELL_OBSTACLE"] = WIRE_CELL_OBSTACLE;
    m.attr("WIRE") = wire;
    m.def("config_message", config_message, nb::arg("uid_first"), nb::arg("uid_last"),
          nb::arg("key"), nb::arg("value"), "A CONFIG message: nine data bytes and the type.");
    nb::exception<EngineError>(m, "EngineError", PyExc_ValueError);
    register_bridge(m);
    register_twins(m);

    nb::class_<PythonSimulation>(m, "Simulation", "One run; see emulator/simulation/simulation.h.")
        .def(nb::init<const nb::dict &>(), nb::arg("spec"))
        .def(
            "advance",
            [](PythonSimulation &self, int64_t ticks) { self.simulation.advance(ticks); },
            nb::arg("ticks"), nb::call_guard<nb::gil_scoped_release>(),
            "Go on by at least `ticks`, to the end of a world step.")
        .def_prop_ro("tick", [](const PythonSimulation &self) { return self.simulation.tick(); })
        .def_prop_ro("robots", [](const PythonSimulation &self) { return self.simulation.size(); })
        .def("samples",
             [](PythonSimulation &self) {
                 return to_python(self.simulation.take_samples(), self.simulation.size());
             })
        .def("snapshot",
             [](PythonSimulation &self) {
                 return to_python(self.simulation.snapshot(), self.simulation.size());
             })
        .def("events",
             [](PythonSimulation &self) {
                 return to_python(self.simulation, self.simulation.take_events());
             })
        .def("result_hash", hash_of)
        .def(
            "send",
            [](PythonSimulation &self, const nb::bytes &message, uint16_t first, uint16_t last,
               nb::object region) {
                self.simulation.send(command_of(message, first, last, region));
            },
            nb::arg("message"), nb::arg("uid_first") = 0, nb::arg("uid_last") = 65535,
            nb::arg("region").none() = nb::none(),
            "Give robots a message now: nine data bytes and a type.")
        .def("send_can", send_can, nb::arg("bus"), nb::arg("id"), nb::arg("data"),
             "Queue a frame at the host's node of a bus; False if its queue is full.")
        .def("can_frames", can_frames, "What ended on any bus since the last call.")
        .def("cells", cells_of, "[row, column, 2] of all cells: colour of 3 bits, brightness.")
        .def("modules", modules_of, "One dict per module, row by row from the lower left.")
        .def("can_stats", can_stats, "One dict per bus.")
        .def("cell_stats", cell_stats, "What became of infrared frames from and to cells.")
        .def("module_events", module_events, "Prints and failures of module programs.")
        .def("motors", motors_of)
        .def("frames", frames_of, "[N, 2]: sent and received; no rows with the ideal medium.")
        .def("state",
             [](const PythonSimulation &self, size_t robot) {
                 auto bytes = robot_of(self, robot).state();
                 return nb::bytes(bytes.data(), bytes.size());
             })
        .def("program",
             [](const PythonSimulation &self, size_t robot) { return program_of(self, robot); })
        .def(
            "serve_debugger",
            [](PythonSimulation &self, size_t robot, uint16_t port) {
                self.simulation.serve_debugger(robot, port);
            },
            nb::arg("robot"), nb::arg("port"),
            "Let gdb control a robot on a board, by 127.0.0.1:port. Nothing goes on until it says "
            "so.")
        .def(
            "trace",
            [](PythonSimulation &self, size_t robot, const std::string &path) {
                self.simulation.trace(robot, path);
            },
            nb::arg("robot"), nb::arg("path"),
            "Write what the pins of a robot on a board do from now on to a VCD file.")
        .def("stats", [](const PythonSimulation &self) {
            return to_python(self.simulation.statistics(), 2 * self.def.profile.radius_m);
        });
}
