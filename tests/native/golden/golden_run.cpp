// One run that meets all that could differ between compilers: a crowd in contact, the floor,
// messages with line of sight, the paper's firmware, and a program that waits and delays; and one
// of Kilobots on a Kilogrid, with errors on its buses. Prints a hash of both results.
#include <algorithm>
#include <cstdio>
#include <string>

#include "../settings.h"
#include "aggregation/wire.h"
#include "physics/contact/box2d_solver.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace {

constexpr int64_t DURATION_TICKS = 18'311;  // 600 s
constexpr uint16_t ALL = UINT16_MAX;

message_t config(uint8_t key, uint32_t value) {
    message_t message = {};
    wire_put_config(message.data, {0, ALL, key, value});
    message.type = WIRE_TYPE_CONFIG;
    return message;
}

message_t run() {
    message_t message = {};
    message.type = RUN;
    return message;
}

std::string guest(const char *name) { return std::string(GUESTS) + "/" + name + ".so"; }

SimulationDef crowd_definition() {
    Arena arena;
    arena.bounds = {Region::Shape::CIRCLE, {0, 0}, {5, 5}};
    arena.sites = {{Region::Shape::CIRCLE, {-1.2, 0}, {1.6, 1.6}},
                   {Region::Shape::RECTANGLE, {1.2, 0}, {1, 1.4}}};
    auto def = definition(arena);
    def.seed = 20240229;
    def.floor = floor_settings();
    def.groups = {{guest("aggregation"), "aggregation", 50, {}, Tier::NATIVE},
                  {guest("wanderer"), "wanderer", 10, {}, Tier::NATIVE}};
    // CONFIG of a foot-bot: rests where it is pushed to; turns take 0.70 s a radian; legs of 5 s,
    // entry 10 s, leave test 2 s.
    def.commands = {{-7, 0, 50, config(WIRE_KEY_PUSHED_OFF, 0)},
                    {-6, 0, ALL, config(WIRE_KEY_TURN_TICKS_PER_RAD, 1'400'000)},
                    {-5, 0, ALL, config(WIRE_KEY_STRAIGHT_TICKS, 153)},
                    {-4, 0, ALL, config(WIRE_KEY_ENTRY_TICKS, 305)},
                    {-3, 0, ALL, config(WIRE_KEY_UPDATE_TICKS, 61)},
                    {-2, 0, ALL, config(WIRE_KEY_WINDOW_TICKS, 18)},
                    {0, 0, ALL, run()}};
    return def;
}

/// A hall with sharp corners, obstacles that block light, and objects.
SimulationDef walls_definition() {
    auto def = crowd_definition();
    Arena arena = {
        Region::polygon({{-2, -1.5}, {2, -1.2}, {0.6, 0}, {2.2, 1.6}, {-1.8, 1.5}}),
        {Region::polygon({{-1, -1}, {0.4, -0.9}, {-0.2, -0.4}, {-0.3, 0.6}})},
        {{{Region::Shape::CIRCLE, {-1.2, 0.6}, {0.4, 0.4}}, true},
         {Region{Region::Shape::RECTANGLE, {0, 0}, {0.8, 0.02}}.placed({0.1, 0.3}, 1), true}}};
    arena.build_walls(true, 0.3);
    def.arena = arena;
    def.groups[0].count = 30;
    const ObjectPart disc = {{0, 0}, 0.15, {}};
    const ObjectPart wedge = {{}, 0, {{-0.1, -0.1}, {0.3, 0}, {-0.1, 0.1}}};
    def.objects = {{{disc}, Pose{{-1.2, -0.8}, 0}, 1, 0.05, 0.05, 0.3},
                   {{wedge, disc}, {}, 0.5, 0.02, 0.02, 0.5}};
    return def;
}

uint64_t walls_hash() {
    Simulation simulation(walls_definition());
    simulation.advance(4000);
    return final_hash(simulation.snapshot());
}

SimulationDef grid_definition() {
    auto def = definition({{Region::Shape::RECTANGLE, {0, 0}, {0.6, 0.4}}, {}});
    def.seed = 20240301;
    def.profile = small_robot();
    def.profile.speed_m_s = 0.013;
    def.profile.legs = def.profile.kick_needed = true;
    def.profile.motor_noise = 0.2;
    def.kilobot_medium = infrared_settings();
    def.clock_spread = def.sensitivity_spread = 0.005;
    auto grid = grid_settings(6, 4, 2);
    grid.program = guest("module_lab");
    grid.name = "module_lab";
    grid.error_share = 0.05;
    def.grid = grid;
    def.lead_ticks = 128;
    def.groups = {{guest("wanderer"), "wanderer", 15, {}, Tier::NATIVE}};
    def.commands = {{0, 0, ALL, run()}};
    return def;
}

/// Robots and all that went over the buses.
uint64_t grid_hash() {
    Simulation simulation(grid_definition());
    auto tell_modules = [&](std::initializer_list<uint8_t> data) {
        CanFrame frame;
        frame.dlc = static_cast<uint8_t>(data.size());
        std::copy(data.begin(), data.end(), frame.data.begin());
        for (uint32_t bus = 0; bus < 2; bus++) simulation.send_can(bus, frame);
    };
    simulation.advance(60);
    tell_modules({0x0F, 0, 4, 0, 0, 0, 0, 0});  // a configuration of four bytes
    tell_modules({0x10, 0, 1, 2, 3, 4, 0, 0});  // these
    tell_modules({0x0D, 0, 0, 0, 0, 0, 0, 0});  // run
    uint64_t hash = 0xCBF29CE484222325u;
    for (int poll = 0; poll < 40; poll++) {
        tell_modules({0x15});  // what did robots report? To all at once, which keeps the bus busy
        simulation.advance(50);
        for (const auto &logged : simulation.grid().take_frames())
            hash = (hash ^ logged.at ^ logged.frame.id) * 0x100000001B3u;
    }
    return hash ^ final_hash(simulation.snapshot());
}

}  // namespace

int main() {
    Simulation simulation(crowd_definition());
    simulation.advance(DURATION_TICKS);
    const auto &statistics = simulation.statistics();
    std::printf("%016llx box2d %s, %llu frames heard, %llu solver steps, %llu contacts; "
                "among walls %016llx\n",
                static_cast<unsigned long long>(final_hash(simulation.snapshot()) ^ grid_hash()),
                box2d_version().c_str(),
                static_cast<unsigned long long>(statistics.medium.received),
                static_cast<unsigned long long>(statistics.solver_steps),
                static_cast<unsigned long long>(statistics.overlaps.contacts()),
                static_cast<unsigned long long>(walls_hash()));
    return 0;
}
