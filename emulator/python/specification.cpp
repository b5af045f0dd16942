#include "python/specification.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "aggregation/wire.h"
#include "base/errors.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

/// The value under a key that the host always writes.
template <typename T> T get(const nb::dict &from, const char *key) {
    if (!from.contains(key)) throw EngineError(std::string("the run's specification lacks ") + key);
    return nb::cast<T>(from[key]);
}

/// A point as [x_m, y_m].
Eigen::Vector2d vector_of(const std::vector<double> &xy) {
    if (xy.size() != 2) throw EngineError("a point has two coordinates");
    return {xy[0], xy[1]};
}

/// `centre` is given apart: the arena has none in its table, it lies around (0, 0).
Region region_of(const nb::dict &from, const Eigen::Vector2d &centre) {
    auto shape = get<std::string>(from, "shape");
    if (shape != "circle" && shape != "rectangle")
        throw EngineError("shape is circle or rectangle, not " + shape);
    return {shape == "circle" ? Region::Shape::CIRCLE : Region::Shape::RECTANGLE,
            centre,
            {get<double>(from, "width_m"), get<double>(from, "height_m")}};
}

/// The value under a key that the host may leave out.
template <typename T> T get_or(const nb::dict &from, const char *key, T otherwise) {
    return from.contains(key) ? nb::cast<T>(from[key]) : otherwise;
}

/// `engine.contact_solver` by name.
SolverKind solver_of(const std::string &name) {
    if (name == "discs") return SolverKind::DISCS;
    if (name == "box2d") return SolverKind::BOX2D;
    throw EngineError("the solver of contacts is discs or box2d, not " + name);
}

/// What the robots are like: required keys are those of every profile, the others those of the
/// Kilobot.
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

/// The table `medium`: kind "ideal", or "kilobot" with any of its settings.
void set_medium(SimulationDef &def, const nb::dict &from) {
    auto kind = get<std::string>(from, "kind");
    def.range_m = get<double>(from, "range_m");
    if (kind == "ideal") {
        def.line_of_sight = get<bool>(from, "line_of_sight");
        return;
    }
    if (kind != "kilobot") throw EngineError("the medium is ideal or kilobot, not " + kind);
    KilobotChannel::Settings s;
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

/// Rows of x_m, y_m, heading_rad, in the order of the robots.
std::vector<Pose> poses_of(nb::handle from) {
    std::vector<Pose> poses;
    for (nb::handle row : from) {
        auto values = nb::cast<std::vector<double>>(row);
        if (values.size() != 3) throw EngineError("a pose is x_m, y_m, heading_rad");
        poses.push_back({{values[0], values[1]}, values[2]});
    }
    return poses;
}

/// The table `light`: the reading everywhere, and lamps.
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

/// A fault of one module, by the tick since RUN.
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

/// The table `grid`; the infrared of its cells is under `modules`.
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

/// Robots of one program each; a group without poses is placed at random.
std::vector<SimulationDef::Group> groups_of(const nb::list &from) {
    std::vector<SimulationDef::Group> groups;
    for (nb::handle item : from) {
        auto table = nb::cast<nb::dict>(item);
        SimulationDef::Group group = {get<std::string>(table, "program"),
                                      get<std::string>(table, "name"),
                                      get<size_t>(table, "count"),
                                      {}};
        if (!table["poses"].is_none()) group.poses = poses_of(table["poses"]);
        group.on_board = get_or(table, "on_board", false);
        if (!group.poses.empty() && group.poses.size() != group.count)
            throw EngineError("a group has as many poses as robots, or none");
        groups.push_back(std::move(group));
    }
    return groups;
}

/// Messages of the overhead controller, in any order.
std::vector<SimulationDef::Command> commands_of(const nb::list &from) {
    std::vector<SimulationDef::Command> commands;
    for (nb::handle item : from) {
        auto fields = nb::cast<nb::tuple>(item);
        if (fields.size() != 5)
            throw EngineError("a command is tick, uid_first, uid_last, message, region");
        auto command = command_of(nb::cast<nb::bytes>(fields[3]), nb::cast<uint16_t>(fields[1]),
                                  nb::cast<uint16_t>(fields[2]), fields[4]);
        command.tick = nb::cast<int64_t>(fields[0]);
        commands.push_back(command);
    }
    return commands;
}

/// The wall and the sites, which are numbered from 1 in the order of the list.
Arena arena_of(const nb::dict &spec) {
    Arena arena;
    arena.bounds = region_of(get<nb::dict>(spec, "arena"), {0, 0});
    for (nb::handle site : get<nb::list>(spec, "sites")) {
        auto from = nb::cast<nb::dict>(site);
        arena.sites.push_back(
            region_of(from, vector_of(get<std::vector<double>>(from, "centre_m"))));
    }
    return arena;
}

}  // namespace

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

SimulationDef definition_of(const nb::dict &spec) {
    SimulationDef def;
    def.seed = get<uint64_t>(spec, "seed");
    def.step_ticks = get<uint32_t>(spec, "step_ticks");
    def.arena = arena_of(spec);
    def.profile = profile_of(get<nb::dict>(spec, "profile"));
    def.solver = solver_of(get<std::string>(spec, "contact_solver"));
    if (!spec["floor"].is_none()) {
        auto floor = get<nb::dict>(spec, "floor");
        def.floor = VirtualFloor::Settings{get<double>(floor, "obstacle_m"),
                                           get<uint32_t>(floor, "step_ticks"),
                                           get<uint32_t>(floor, "repeat_ticks")};
    }
    set_medium(def, get<nb::dict>(spec, "medium"));
    def.groups = groups_of(get<nb::list>(spec, "groups"));
    def.commands = commands_of(get<nb::list>(spec, "commands"));
    // From here on a run may lack the thing: no grid, no lamps, a battery that never drains.
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

}  // namespace kilotwin
