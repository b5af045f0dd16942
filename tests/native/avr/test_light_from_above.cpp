// Frames of an overhead controller: several within a world step, on chips and on robots as guests.
#include <doctest/doctest.h>

#include "../settings.h"
#include "base/message_crc.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_light_from_above {

namespace {

/// From the begin of a frame to that of the next, when they go out back to back.
constexpr Cycles BACK_TO_BACK = FRAME_CYCLES + 640;

message_t frame(uint8_t type, bool right = true) {
    message_t message = {};
    message.type = static_cast<decltype(message.type)>(type);
    message.crc = static_cast<uint16_t>(crc_of(message) ^ (right ? 0 : 0x10));
    return message;
}

/// Two robots with one program, far apart: one on a chip, one as a guest. Each shows as its LED how
/// many messages it has received.
SimulationDef chip_and_guest(uint32_t step_ticks = 1) {
    auto def = definition({{Region::Shape::RECTANGLE, {0, 0}, {3, 3}}, {}});
    def.step_ticks = step_ticks;
    def.profile = small_robot();
    def.profile.legs = true;
    def.kilobot_medium = infrared_settings();
    def.groups.push_back({PROGRAMS "/mate.hex", "mate", 1, {{{-1, 0}, 0}}, Tier::CHIP});
    def.groups.push_back({GUESTS "/mate.so", "mate", 1, {{{1, 0}, 0}}, Tier::NATIVE});
    return def;
}

}  // namespace

TEST_CASE("seven frames back to back within a tick reach chips and guests") {
    for (uint32_t step_ticks : {1u, 4u}) {
        Simulation simulation(chip_and_guest(step_ticks));
        simulation.shine_from_above(frame(RUN), simulation.now());
        simulation.advance(4);
        for (Cycles i = 0; i < 7; i++)
            simulation.shine_from_above(frame(0), simulation.now() + i * BACK_TO_BACK);
        simulation.advance(4);
        CHECK(simulation.robot(0).color(0) == 7);
        CHECK(simulation.robot(1).color(0) == 7);
    }
}

TEST_CASE("a frame with a wrong CRC is taken by no robot") {
    Simulation simulation(chip_and_guest());
    simulation.shine_from_above(frame(RUN), simulation.now());
    simulation.advance(4);
    simulation.shine_from_above(frame(0, false), simulation.now());
    simulation.shine_from_above(frame(0), simulation.now() + 2 * BACK_TO_BACK);
    simulation.advance(4);
    CHECK(simulation.robot(0).color(0) == 1);
    CHECK(simulation.robot(1).color(0) == 1);
}

TEST_CASE("a frame may end steps later, is never in the past, and comes in order of time") {
    for (bool run_ahead : {true, false}) {
        auto def = chip_and_guest();
        def.run_ahead = run_ahead;
        Simulation simulation(def);
        simulation.shine_from_above(frame(0), simulation.now() + 100 * TICK_CYCLES);
        simulation.shine_from_above(frame(RUN), simulation.now() + 50 * TICK_CYCLES);
        simulation.shine_from_above(frame(0), 0);
        simulation.advance(98);
        for (size_t robot : {0u, 1u}) CHECK(simulation.robot(robot).color(0) == 1);
        simulation.advance(10);
        for (size_t robot : {0u, 1u}) CHECK(simulation.robot(robot).color(0) == 2);
    }
}

}  // namespace test_light_from_above
