// Robots on boards and native ones share a world and hear each other.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "../settings.h"
#include "base/errors.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_mixed_swarm {

namespace {

constexpr double PERIOD_S = 16 * TICK_S;
constexpr uint8_t RUN = 0x88;

/// Robots `spacing_m` apart in a row, the first `boards` of them on boards; heard without loss or
/// noise.
SimulationDef row_of_mates(size_t boards, size_t natives, double spacing_m, uint64_t seed = 1) {
    auto def = definition({{Region::Shape::RECTANGLE, {0, 0}, {3, 3}}, {}});
    def.seed = seed;
    def.profile = small_robot();
    def.profile.legs = true;
    auto exact = infrared_settings();
    exact.range_spread = exact.loss = exact.loss_at_range = exact.gain_noise_lsb = 0;
    def.kilobot_medium = exact;
    def.clock_spread = 0.01;
    std::vector<Pose> places;
    for (size_t i = 0; i < boards + natives; i++)
        places.push_back({{spacing_m * static_cast<double>(i), 0}, 0});
    const auto middle = places.begin() + static_cast<ptrdiff_t>(boards);
    if (boards > 0)
        def.groups.push_back(
            {PROGRAMS "/mate.hex", "mate", boards, {places.begin(), middle}, Tier::CHIP});
    if (natives > 0)
        def.groups.push_back(
            {GUESTS "/mate.so", "mate", natives, {middle, places.end()}, Tier::NATIVE});
    message_t run = {};
    run.type = static_cast<decltype(run.type)>(RUN);
    def.commands.push_back({0, 0, 65535, run});
    return def;
}

int heard_by(const Simulation &simulation, size_t robot) {
    return simulation.robot(robot).color(0);
}

}  // namespace

TEST_CASE("a robot on a board and a native one hear nearly everything that the other says") {
    constexpr double DURATION_S = 20;
    for (size_t boards : {0u, 1u, 2u}) {
        CAPTURE(boards);
        Simulation simulation(row_of_mates(boards, 2 - boards, 0.05));
        simulation.advance(static_cast<int64_t>(DURATION_S / TICK_S));
        const int said = static_cast<int>(DURATION_S / PERIOD_S);
        for (size_t robot : {0u, 1u}) {
            CHECK(heard_by(simulation, robot) <= said + 1);
            CHECK(heard_by(simulation, robot) >= said - 3);
        }
        CHECK(std::abs(static_cast<int>(simulation.statistics().medium.sent) - 2 * said) <= 4);
    }
}

TEST_CASE("a robot out of range hears nothing, on a board or not") {
    for (size_t boards : {0u, 1u, 2u}) {
        Simulation simulation(row_of_mates(boards, 2 - boards, 0.1001));
        simulation.advance(300);
        CHECK(heard_by(simulation, 0) == 0);
        CHECK(heard_by(simulation, 1) == 0);
    }
}

TEST_CASE("a board reads the distance of the robot that sends to it") {
    const auto image = FlashImage::load(PROGRAMS "/mate.elf");
    for (double distance_m : {0.04, 0.06, 0.09}) {
        Simulation simulation(row_of_mates(1, 1, distance_m));
        simulation.advance(100);
        const auto &board = simulation.boards().board(0);
        CHECK(board.read(*image->symbol("from")) == 2);
        CHECK(std::abs(board.read(*image->symbol("distance_mm")) - 1000 * distance_m) <= 3);
    }
}

TEST_CASE("a mixed swarm sends and hears as much as a native one") {
    constexpr double DURATION_S = 30;
    auto counts = [&](size_t boards) {
        Simulation simulation(row_of_mates(boards, 12 - boards, 0.04, 3));
        simulation.advance(static_cast<int64_t>(DURATION_S / TICK_S));
        return simulation.statistics().medium;
    };
    const auto native = counts(0), mixed = counts(4);
    const double sent = static_cast<double>(native.sent),
                 heard = static_cast<double>(native.received);
    CHECK(std::abs(static_cast<double>(mixed.sent) - sent) <= 0.02 * sent);
    // Collisions are chance: four standard deviations of a count.
    CHECK(std::abs(static_cast<double>(mixed.received) - heard) <= 4 * std::sqrt(heard));
}

TEST_CASE("the same mixed swarm twice is the same, bit for bit") {
    auto hash = [] {
        Simulation simulation(row_of_mates(3, 3, 0.04, 5));
        simulation.advance(300);
        return final_hash(simulation.snapshot());
    };
    CHECK(hash() == hash());
}

TEST_CASE("chips that wait are left alone, and do as chips that execute every instruction") {
    auto outcome = [](bool skips) {
        Simulation simulation(row_of_mates(4, 2, 0.04, 7));
        for (uint32_t robot = 0; robot < 4; robot++)
            if (!skips) simulation.boards().board(robot).skip_nothing();
        simulation.advance(100);
        std::vector<uint8_t> memory;
        // The variables; how deep the stack is depends on where a wait was left.
        for (uint32_t robot = 0; robot < 4; robot++)
            for (uint16_t address = 0x100; address < 0x200; address++)
                memory.push_back(simulation.boards().board(robot).read(address));
        return std::pair(simulation.result_hash(), memory);
    };
    CHECK(outcome(true) == outcome(false));
}

TEST_CASE("boards need the Kilobot medium, and only they can be debugged") {
    auto def = row_of_mates(1, 1, 0.05);
    Simulation simulation(def);
    CHECK_THROWS_WITH_AS(simulation.trace(1, "x.vcd"),
                         doctest::Contains("robot 1 does not run on a board"), EngineError);
    CHECK_THROWS_WITH_AS(simulation.trace(2, "x.vcd"), "there is no robot 2", EngineError);
    def.kilobot_medium.reset();
    CHECK_THROWS_WITH_AS(Simulation{def}, doctest::Contains("need the kilobot medium"),
                         EngineError);
}

TEST_CASE("a robot's reset by its watchdog is an event that names it and the cause") {
    auto def = row_of_mates(1, 1, 0.05);
    def.groups.front().program = PROGRAMS "/sleeper.hex";
    Simulation simulation(def);
    simulation.advance(static_cast<int64_t>(4 / TICK_S));
    std::vector<std::string> notes;
    for (const auto &event : simulation.take_events()) {
        if (event.kind != EventKind::NOTE) continue;
        CHECK(event.robot == 0);
        CHECK(event.program == "mate");
        notes.push_back(event.text);
    }
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].starts_with("its watchdog reset it: not fed for 1024 ms, at PC 0x"));
}

}  // namespace test_mixed_swarm
