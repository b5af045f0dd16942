// Where the engine keeps robots: by place, and that nothing which leaves it tells.
#include <doctest/doctest.h>

#include <algorithm>

#include "base/slots.h"
#include "physics/placement.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_slots {

namespace {

/// All that can be asked of a run's robots, by index.
struct Outcome {
    uint64_t hash = 0;
    std::vector<float> x_m;
    std::vector<uint32_t> counts;
    std::vector<std::string> events, heard, arrivals;
    std::vector<std::vector<uint8_t>> variables;
    bool operator==(const Outcome &) const = default;
};

Outcome outcome_of(SimulationDef def, size_t kept_by_place_from, uint32_t threads = 1) {
    def.kept_by_place_from = kept_by_place_from;
    def.threads = threads;
    def.sample_extras = {true, true, true};
    Simulation simulation(def);
    simulation.listen_to({3, 17});
    Outcome outcome;
    simulation.advance(500);
    simulation.place(5, {{14.5, -14.5}, 1});
    simulation.turn(6, 2);
    Trail &trail = simulation.keep_trail(10'000, false);
    simulation.advance(500);
    for (const Trail::Arrival &one : trail.take_arrivals())
        outcome.arrivals.push_back(std::to_string(one.at) + " " + std::to_string(one.from.number) +
                                   " to " + std::to_string(one.to.number));
    std::sort(outcome.arrivals.begin(), outcome.arrivals.end());
    for (const Event &event : simulation.take_events())
        outcome.events.push_back(std::to_string(event.at) + " " + std::to_string(event.robot) +
                                 " " + text_without_address(event));
    const Samples samples = simulation.take_samples();
    outcome.x_m = samples.x_m;
    outcome.counts = samples.received;
    for (const FrameCounts &frames : simulation.frames()) outcome.counts.push_back(frames.sent);
    for (uint32_t robot = 0; robot < simulation.size(); robot++) {
        CHECK(simulation.robot(robot).index() == robot);
        CHECK(simulation.robot(robot).uid() == robot + 1);
        outcome.counts.push_back(static_cast<uint32_t>(1000 * simulation.hummed_s(robot)));
        outcome.counts.push_back(simulation.robot(robot).decisions());
        outcome.variables.push_back(simulation.robot(robot).variables());
    }
    for (const Heard &one : simulation.heard_by(17))
        outcome.heard.push_back(std::to_string(one.at));
    outcome.hash = simulation.result_hash();
    CHECK(simulation.statistics().island_steps == 0);  // where an order would tell
    return outcome;
}

/// Robots of several programs on a table so large that no three of them touch, and loud enough.
Scene wide_world(uint64_t seed, bool kilobot_medium) {
    Scene scene(square_hall(30), seed);
    scene.def.range_m = 8;
    if (kilobot_medium) scene.def.kilobot_medium = infrared_settings();
    if (kilobot_medium) scene.def.kilobot_medium->range_m = 8;
    scene.def.sample_ticks = 77;
    scene.add_anywhere("wanderer", 12);
    scene.add_anywhere("talker", 10);
    scene.add_anywhere("sender", 8);
    scene.def.faults = {{200, 4, RobotFault::Kind::DEAD, 0, 0},
                        {250, 13, RobotFault::Kind::DEAF, 0, 0},
                        {300, 9, RobotFault::Kind::MOTORS, 0.5, 1},
                        {300, 25, RobotFault::Kind::MUTE, 0, 0}};
    scene.tell(300, 24, message(0x30, {200, 0}));
    return scene;
}

}  // namespace

TEST_CASE("robots are kept along a curve: those of a quarter of the table side by side") {
    std::vector<Pose> poses;
    for (int i = 0; i < 64; i++)
        poses.push_back({{(i * 37 % 64) % 8 * 0.8, (i * 37 % 64) / 8 * 0.8}, 0});
    const std::vector<uint32_t> order = by_place(poses);
    REQUIRE(order.size() == 64);
    for (size_t quarter = 0; quarter < 4; quarter++) {
        Eigen::Vector2d low(8, 8), high(-1, -1);
        for (size_t i = 16 * quarter; i < 16 * (quarter + 1); i++) {
            low = low.cwiseMin(poses[order[i]].position);
            high = high.cwiseMax(poses[order[i]].position);
        }
        CHECK((high - low).maxCoeff() <= 2.5);
    }
    std::vector<uint32_t> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    for (uint32_t i = 0; i < 64; i++) CHECK(sorted[i] == i);
    CHECK(by_place({}).empty());
}

TEST_CASE("robots in the same place are kept by index") {
    CHECK(by_place({{{1, 1}, 0}, {{0, 0}, 0}, {{1, 1}, 0}}) == std::vector<uint32_t>{1, 0, 2});
}

TEST_CASE("a slot leads to an index and back") {
    const Slots slots({2, 0, 1});
    CHECK(slots.size() == 3);
    CHECK(slots.index_in(0) == 2);
    for (uint32_t index = 0; index < 3; index++)
        CHECK(slots.index_in(slots.slot_of(index)) == index);
    CHECK(Slots(2).slot_of(1) == 1);
}

TEST_CASE("robots kept by place do what robots kept by index do, and are told by index") {
    for (uint64_t seed = 1; seed <= 4; seed++)
        for (const bool kilobot_medium : {false, true}) {
            CAPTURE(seed);
            CAPTURE(kilobot_medium);
            Scene scene = wide_world(seed, kilobot_medium);
            if (seed > 2) scene.def.floor = floor_settings();
            if (seed == 4) scene.def.light.sources = {{{0.5, 0.8}, 900, 0.5}};
            const Outcome by_index = outcome_of(scene.def, SIZE_MAX);
            for (const uint32_t threads : {1u, 3u}) {
                const Outcome here = outcome_of(scene.def, 0, threads);
                CHECK(here.hash == by_index.hash);
                CHECK(here.x_m == by_index.x_m);
                CHECK(here.counts == by_index.counts);
                CHECK(here.events == by_index.events);
                CHECK(here.heard == by_index.heard);
                CHECK(here.arrivals == by_index.arrivals);
                if (threads == 1) CHECK((here.variables == by_index.variables));
            }
            CHECK_FALSE(by_index.heard.empty());
            CHECK_FALSE(by_index.arrivals.empty());
        }
}

TEST_CASE(
    "a message of an overhead controller reaches the robots below it, wherever they are kept") {
    Scene scene = wide_world(7, false);
    scene.def.overhead = {Region{Region::Shape::RECTANGLE, {-8, 0}, {14, 30}}};
    std::vector<uint32_t> received[2];
    for (const bool by_place : {false, true}) {
        scene.def.kept_by_place_from = by_place ? 0 : SIZE_MAX;
        Simulation simulation(scene.def);
        simulation.shine_from_above(message(0x55), simulation.now() + ticks(10));
        simulation.advance(100);
        for (const FrameCounts &frames : simulation.frames())
            received[by_place].push_back(frames.received);
    }
    CHECK(received[0] == received[1]);
}

}  // namespace test_slots
