#include "python/specification.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "aggregation/wire.h"
#include "base/errors.h"
#include "base/message_crc.h"
#include "python/table.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

// Radii of a robot: walls farther from its middle are not looked at, at usual speeds and steps.
constexpr double WALLS_MATTER = 3;

/// A point as [x_m, y_m].
Eigen::Vector2d vector_of(const std::vector<double> &xy) {
    if (xy.size() != 2) throw EngineError("a point has two coordinates");
    return {xy[0], xy[1]};
}

/// A circle or rectangle by its width and height, a polygon by its corners; all about (0, 0).
Region region_of(Table &from) {
    const std::string shape = from["shape"];
    if (shape == "polygon") {
        std::vector<Eigen::Vector2d> corners;
        for (const auto &point : from["points_m"].as<std::vector<std::vector<double>>>())
            corners.push_back(vector_of(point));
        if (corners.size() < 3) throw EngineError("a polygon has three corners or more");
        return Region::polygon(std::move(corners));
    }
    if (shape == "picture") return {Region::Shape::PICTURE, {0, 0}, {0, 0}};
    if (shape != "circle" && shape != "rectangle")
        throw EngineError("shape is circle, rectangle or polygon, not " + shape);
    return {shape == "circle" ? Region::Shape::CIRCLE : Region::Shape::RECTANGLE,
            {0, 0},
            {from["width_m"].as<double>(), from["height_m"].as<double>()}};
}

// The table `profile`: the robot's body, and what [motion] says of it.
Profile profile_of(Table from) {
    const Profile profile = {.radius_m = from["radius_m"],
                             .speed_m_s = from["speed_m_s"],
                             .turn_rad_s = from["turn_rad_s"],
                             .mass_kg = from["mass_kg"],
                             .push_m_s2 = from["push_m_s2"],
                             .straight_left = from["straight_left"],
                             .straight_right = from["straight_right"],
                             .turn_left = from["turn_left"],
                             .turn_right = from["turn_right"],
                             .legs = from["legs"],
                             .kick_needed = from["kick_needed"],
                             .gives_way = from["gives_way"],
                             .speed_spread = from["speed_spread"],
                             .bias_spread = from["bias_spread"],
                             .motor_noise = from["motor_noise"]};
    from.end();
    return profile;
}

/// The table `medium`: kind "ideal" or "kilobot", and the settings of that kind.
void set_medium(SimulationDef &def, Table from) {
    const std::string kind = from["kind"];
    from.read("range_m", def.range_m);
    if (kind == "ideal") {
        from.read("line_of_sight", def.line_of_sight);
    } else if (kind == "kilobot") {
        KilobotChannel::Settings settings;
        from.read("loss", settings.loss);
        from.read("loss_at_range", settings.loss_at_range);
        from.read("overhead_loss", settings.overhead_loss);
        from.read("gain_noise_lsb", settings.gain_noise_lsb);
        from.read("distance_error_mm", settings.distance_error_mm);
        from.read("range_m", settings.range_m);
        from.read("range_spread", settings.range_spread);
        from.read("carrier_sense", settings.carrier_sense);
        from.read("collisions", settings.collisions);
        from.read("half_duplex", settings.half_duplex);
        from.read("held_busy", settings.held_busy);
        def.kilobot_medium = settings;
        from.read("clock_spread", def.clock_spread);
        from.read("sensitivity_spread", def.sensitivity_spread);
    } else {
        throw EngineError("the medium is ideal or kilobot, not " + kind);
    }
    from.end();
}

Pose pose_of(const std::vector<double> &from) {
    if (from.size() != 3) throw EngineError("a pose is x_m, y_m, heading_rad");
    return {{from[0], from[1]}, from[2]};
}

/// Rows of x_m, y_m, heading_rad, in the order of the robots.
std::vector<Pose> poses_of(nb::handle from) {
    std::vector<Pose> poses;
    for (nb::handle row : from) poses.push_back(pose_of(nb::cast<std::vector<double>>(row)));
    return poses;
}

/// A picture on the floor: its rows from the lowest up, as bytes.
Raster raster_of(Table from) {
    const auto bytes = from["values"].as<nb::bytes>();
    const auto *values = static_cast<const uint8_t *>(bytes.data());
    const auto columns = from["columns"].as<size_t>();
    if (columns == 0 || bytes.size() == 0 || bytes.size() % columns != 0)
        throw EngineError("a picture has whole rows of pixels");
    const auto low = vector_of(from["low_m"].as<std::vector<double>>());
    Raster raster({values, values + bytes.size()}, columns, low, from["pixel_m"]);
    from.end();
    return raster;
}

/// The table `readings`: of each sensor that reads the same for all robots, by its name.
Readings readings_of(Table from) {
    Readings readings = {};
    for (const Sensor &sensor : SENSORS)
        if (sensor.read == nullptr) from.read(sensor.name, readings[sensor.channel]);
    from.end();
    return readings;
}

/// The table `light`: the reading everywhere, and lamps.
Light light_of(Table from) {
    Light light = {.ambient = from["ambient"], .sources = {}};
    for (nb::handle item : from["sources"].as<nb::list>()) {
        Table source(nb::cast<nb::dict>(item), "light.source.");
        light.sources.push_back({vector_of(source["at_m"].as<std::vector<double>>()),
                                 source["peak"], source["half_m"]});
        source.end();
    }
    if (!from["picture"].is_none()) light.picture = raster_of(from["picture"].table());
    light.white = from["white"];
    from.end();
    return light;
}

/// A fault of one module, by the tick since RUN.
Grid::Fault fault_of(Table from) {
    static const std::pair<const char *, Grid::Fault::Kind> KINDS[] = {
        {"dead", Grid::Fault::Kind::DEAD},
        {"reset", Grid::Fault::Kind::RESET},
        {"bus_off", Grid::Fault::Kind::BUS_OFF},
        {"recover", Grid::Fault::Kind::RECOVER}};
    const std::string name = from["kind"];
    const auto *kind = std::find_if(std::begin(KINDS), std::end(KINDS),
                                    [&](const auto &known) { return name == known.first; });
    if (kind == std::end(KINDS))
        throw EngineError("a fault is dead, reset, bus_off or recover, not " + name);
    const auto module = from["module"].as<std::vector<uint32_t>>();
    if (module.size() != 2) throw EngineError("a module is named by column and row");
    const Grid::Fault fault = {from["at_tick"], kind->second, module[0], module[1]};
    from.end();
    return fault;
}

// The table `grid.cells`, as [grid.cells] of an experiment has it.
CellInfrared cell_infrared_of(Table from) {
    const CellInfrared infrared = {.cell_range_m = from["cell_range_m"],
                                   .robot_range_m = from["robot_range_m"],
                                   .weak_share = from["weak_share"],
                                   .weak_range_m = from["weak_range_m"],
                                   .weak_spell_s = from["weak_spell_s"],
                                   .loss = from["loss"],
                                   .clock_spread = from["clock_spread"]};
    from.end();
    return infrared;
}

/// The table `grid`; None where there is none.
Grid::Settings grid_of(Table from) {
    Grid::Settings grid = {.columns = from["columns"],
                           .rows = from["rows"],
                           .buses = from["buses"],
                           .program = from["program"],
                           .name = from["name"],
                           .infrared = cell_infrared_of(from["cells"].table()),
                           .faults = {},
                           .error_share = from["error_share"],
                           .tier = tier_of(from["tier"])};
    for (nb::handle item : from["faults"].as<nb::list>())
        grid.faults.push_back(fault_of(Table(nb::cast<nb::dict>(item), "grid.faults.")));
    from.end();
    return grid;
}

/// Robots of one program each; a group without poses is placed at random.
// A list of tables; a group's `poses` are None where its robots are placed at random.
std::vector<SimulationDef::Group> groups_of(const nb::list &from) {
    std::vector<SimulationDef::Group> groups;
    for (nb::handle item : from) {
        Table table(nb::cast<nb::dict>(item), "groups.");
        SimulationDef::Group group = {.program = table["program"],
                                      .name = table["name"],
                                      .count = table["count"],
                                      .poses = {},
                                      .tier = tier_of(table["tier"])};
        if (!table["poses"].is_none()) group.poses = poses_of(table["poses"].held());
        if (!group.poses.empty() && group.poses.size() != group.count)
            throw EngineError("a group has as many poses as robots, or none");
        table.end();
        groups.push_back(std::move(group));
    }
    return groups;
}

// A table of a lab's robot: 14 readings, the nearest first. That they fall the host has checked;
// one that does not would do no harm.
void read_gains(const nb::handle from, uint16_t (&table)[GAIN_ENTRIES]) {
    const auto readings = nb::cast<std::vector<uint16_t>>(from);
    if (readings.size() != GAIN_ENTRIES ||
        *std::max_element(readings.begin(), readings.end()) > CONVERTER_MOST)
        throw EngineError("a table of gains has 14 readings of 0 to 1023");
    std::copy(readings.begin(), readings.end(), table);
}

// The list `lab`, by index; empty without a lab. `low_gain` and `high_gain` of a robot are both
// None or both lists: without them its readings are made up, as those of other robots are.
std::vector<SimulationDef::LabRobot> lab_of(const nb::list &from) {
    std::vector<SimulationDef::LabRobot> lab;
    for (nb::handle item : from) {
        Table table(nb::cast<nb::dict>(item), "lab.");
        SimulationDef::LabRobot robot = {.uid = table["uid"],
                                         .turn_left = table["turn_left"],
                                         .turn_right = table["turn_right"],
                                         .straight_left = table["straight_left"],
                                         .straight_right = table["straight_right"],
                                         .gains = {}};
        if (table["low_gain"].is_none() != table["high_gain"].is_none())
            throw EngineError("a robot has both tables of gains, or none");
        if (!table["low_gain"].is_none()) {
            gain_tables_t gains;
            read_gains(table["low_gain"].held(), gains.low);
            read_gains(table["high_gain"].held(), gains.high);
            robot.gains = gains;
        }
        table.end();
        lab.push_back(robot);
    }
    return lab;
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

/// Failures of robots: tick, robot's index, kind, factors of its left and right motor.
std::vector<RobotFault> robot_faults_of(const nb::list &from) {
    static const std::map<std::string, RobotFault::Kind> KINDS = {
        {"dead", RobotFault::Kind::DEAD},           {"deaf", RobotFault::Kind::DEAF},
        {"receives", RobotFault::Kind::RECEIVES},   {"mute", RobotFault::Kind::MUTE},
        {"transmits", RobotFault::Kind::TRANSMITS}, {"motors", RobotFault::Kind::MOTORS}};
    std::vector<RobotFault> faults;
    for (nb::handle item : from) {
        const auto [tick, robot, name, left, right] =
            nb::cast<std::tuple<int64_t, uint32_t, std::string, double, double>>(item);
        const auto kind = KINDS.find(name);
        if (kind == KINDS.end())
            throw EngineError(
                "a robot's fault is dead, deaf, receives, mute, transmits or motors, not " + name);
        faults.push_back({tick, robot, kind->second, left, right});
    }
    return faults;
}

/// Sites of a list, numbered from 1 in its order.
std::vector<Region> sites_of(const nb::list &from) {
    std::vector<Region> sites;
    for (nb::handle item : from) {
        Table site(nb::cast<nb::dict>(item), "sites.");
        const auto centre = vector_of(site["centre_m"].as<std::vector<double>>());
        sites.push_back(region_of(site).placed(centre, 0));
        site.end();
    }
    return sites;
}

/// Obstacles in the arena.
std::vector<Obstacle> obstacles_of(const nb::list &from) {
    std::vector<Obstacle> obstacles;
    for (nb::handle item : from) {
        Table obstacle(nb::cast<nb::dict>(item), "obstacles.");
        const auto centre = vector_of(obstacle["centre_m"].as<std::vector<double>>());
        obstacles.push_back({region_of(obstacle).placed(centre, obstacle["heading_rad"]),
                             obstacle["blocks_light"]});
        obstacle.end();
    }
    return obstacles;
}

/// A circle has a radius and no corners, a convex polygon corners.
ObjectPart part_of(Table from) {
    ObjectPart part = {vector_of(from["centre_m"].as<std::vector<double>>()), from["radius_m"], {}};
    for (const auto &corner : from["corners_m"].as<std::vector<std::vector<double>>>())
        part.corners.push_back(vector_of(corner));
    from.end();
    return part;
}

/// A beacon's message has no CRC here.
BeaconDef beacon_of(uint32_t object, Table from) {
    BeaconDef beacon = {object, message_of(from["message"].as<nb::bytes>()),
                        from["period_ticks"].as<int64_t>() * TICK_CYCLES};
    beacon.message.crc = crc_of(beacon.message);
    from.end();
    return beacon;
}

/// Objects that robots push, with their beacons; one without a pose is placed by chance.
void read_objects(SimulationDef &def, const nb::list &from) {
    auto &objects = def.objects;
    for (nb::handle item : from) {
        Table object(nb::cast<nb::dict>(item), "objects.");
        ObjectDef read = {{},
                          {},
                          object["mass_kg"],
                          object["friction"],
                          object["turning_friction"],
                          object["robot_friction"]};
        for (nb::handle part : object["parts"].as<nb::list>())
            read.parts.push_back(part_of(Table(nb::cast<nb::dict>(part), "objects.parts.")));
        if (!object["pose"].is_none())
            read.pose = pose_of(object["pose"].as<std::vector<double>>());
        if (!object["beacon"].is_none())
            def.beacons.push_back(
                beacon_of(static_cast<uint32_t>(objects.size()), object["beacon"].table()));
        object.end();
        objects.push_back(read);
    }
}

/// Walls, obstacles and sites. `reach_m`: how far away walls matter to a robot.
Arena arena_of(Table &spec, double reach_m) {
    Table bounds = spec["arena"].table();
    Arena arena = {region_of(bounds), sites_of(spec["sites"].as<nb::list>()),
                   obstacles_of(spec["obstacles"].as<nb::list>())};
    arena.build_walls(bounds["blocks_light"], reach_m);
    if (!spec["picture"].is_none()) {
        arena.floor = raster_of(spec["picture"].table());
        arena.floor.find_distances();
    }
    bounds.end();
    return arena;
}

// The table `floor`; None where robots have no virtual floor.
VirtualFloor::Settings floor_of(Table from) {
    const VirtualFloor::Settings floor = {.obstacle_m = from["obstacle_m"],
                                          .step_ticks = from["step_ticks"],
                                          .repeat_ticks = from["repeat_ticks"]};
    from.end();
    return floor;
}

SampleExtras extras_of(Table extras) {
    SampleExtras out = {};
    extras.read("motors", out.motors);
    extras.read("battery", out.battery);
    extras.read("messages", out.messages);
    extras.end();
    return out;
}

}  // namespace

Tier tier_of(const std::string &word) {
    static constexpr std::pair<const char *, Tier> TIERS[] = {{"native", Tier::NATIVE},
                                                              {"translated", Tier::TRANSLATED},
                                                              {"chip", Tier::CHIP},
                                                              {"interpreted", Tier::INTERPRETED}};
    for (const auto &[name, tier] : TIERS)
        if (word == name) return tier;
    throw EngineError("a tier is native, translated, chip or interpreted, not " + word);
}

message_t message_of(const nb::bytes &bytes) {
    if (bytes.size() != WIRE_DATA_BYTES + 1)
        throw EngineError("a message has nine data bytes and a type");
    message_t message = {};
    std::memcpy(&message, bytes.c_str(), WIRE_DATA_BYTES + 1);
    return message;
}

message_t frame_of(const nb::bytes &bytes) {
    message_t frame = {};
    if (bytes.size() != sizeof frame)
        throw EngineError("a frame has nine data bytes, type and CRC");
    std::memcpy(&frame, bytes.c_str(), sizeof frame);
    return frame;
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

SimulationDef definition_of(const nb::dict &from) {
    Table spec(from);
    SimulationDef def = {};
    spec.read("seed", def.seed);
    spec.read("step_ticks", def.step_ticks);
    def.profile = profile_of(spec["profile"].table());
    // None: the run lacks the thing. All other keys have a value.
    if (!spec["floor"].is_none()) def.floor = floor_of(spec["floor"].table());
    def.arena = arena_of(spec, WALLS_MATTER * def.profile.radius_m +
                                   (def.floor ? def.floor->obstacle_m : 0));
    set_medium(def, spec["medium"].table());
    read_objects(def, spec["objects"].as<nb::list>());
    def.groups = groups_of(spec["groups"].as<nb::list>());
    def.lab = lab_of(spec["lab"].as<nb::list>());
    def.commands = commands_of(spec["commands"].as<nb::list>());
    def.overhead = sites_of(spec["overhead"].as<nb::list>());
    def.faults = robot_faults_of(spec["faults"].as<nb::list>());
    if (!spec["grid"].is_none()) def.grid = grid_of(spec["grid"].table());
    spec.read("on_ticks", def.on_ticks);
    spec.read("lead_ticks", def.lead_ticks);
    def.light = light_of(spec["light"].table());
    spec.read("battery_h", def.battery_h);
    def.readings = readings_of(spec["readings"].table());
    spec.read("sample_ticks", def.sample_ticks);
    def.sample_extras = extras_of(spec["sample_extras"].table());
    if (!spec["black_box"].is_none()) def.black_box = spec["black_box"].as<std::string>();
    if (!spec["debugged"].is_none()) {
        Table debugged = spec["debugged"].table();
        def.debugged = {debugged["robot"], debugged["port"]};
        debugged.end();
    }
    spec.read("run_ahead", def.run_ahead);
    spec.read("recalls_passes", def.recalls_passes);
    spec.read("threads", def.threads);
    spec.end();
    return def;
}

}  // namespace kilotwin
