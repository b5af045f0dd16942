// A robot that is taken away by hand goes on where it is put, as if it had always been there.
#include <doctest/doctest.h>

#include <algorithm>
#include <tuple>

#include "base/errors.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_placed_robots {

namespace {

/// All that can be known of a run.
struct Seen {
    uint64_t hash;
    uint64_t solver_steps, received, list_rebuilds;
    double worst_overlap;
    bool operator==(const Seen &) const = default;
};

/// Puts a robot at the first place from the arena's middle outwards where it has room.
void put_somewhere(Simulation &simulation, uint32_t robot, double from_m) {
    for (int i = 0; i < 2000; i++) {
        const double x = from_m + 0.01 * (i % 100), y = 0.05 * (i / 100);
        try {
            simulation.place(robot, {{x, -y}, x});
            return;
        } catch (const EngineError &) {
            continue;
        }
    }
    FAIL("no room");
}

Seen seen_of(SimulationDef def, bool run_ahead, int64_t chunk) {
    def.run_ahead = run_ahead;
    Simulation simulation(def);
    for (uint32_t k = 0; k < 6; k++) {
        const int64_t until = 200 * (k + 1);
        while (simulation.tick() < until)
            simulation.advance(std::min(chunk, until - simulation.tick()));
        put_somewhere(simulation, 5 * k, 0.1 * (k % 3));
        if (k == 3) put_somewhere(simulation, 2, 0);
        simulation.turn(3 * k + 1, 0.7 * k);
    }
    simulation.advance(400);
    const Statistics statistics = simulation.statistics();
    return {simulation.result_hash(), statistics.solver_steps, statistics.medium.received,
            statistics.list_rebuilds, statistics.overlaps.worst()};
}

void check_placed_alike(const SimulationDef &def) {
    const Seen ahead = seen_of(def, true, 200);
    CHECK(ahead == seen_of(def, false, 200));
    CHECK(ahead == seen_of(def, true, 8));
    CHECK(ahead == seen_of(def, false, 40));
    CHECK(ahead.worst_overlap < 0.1);
    MESSAGE(ahead.received << " frames heard, " << ahead.solver_steps << " solver steps");
}

}  // namespace

TEST_CASE("robots put elsewhere: run ahead, tick by tick and in chunks give the same") {
    for (uint64_t seed = 1; seed <= 4; seed++) {
        CAPTURE(seed);
        Scene scene(round_hall(2.5), seed);
        scene.def.step_ticks = seed == 3 ? 1 : seed == 4 ? 4 : 2;
        if (seed % 2) scene.def.floor = floor_settings();
        scene.def.sample_ticks = 77;
        scene.add_anywhere("wanderer", 40);
        check_placed_alike(scene.def);
    }
}

TEST_CASE("on the Kilobot medium robots put elsewhere go on alike in all ways, too") {
    for (uint64_t seed = 31; seed <= 34; seed++) {
        CAPTURE(seed);
        Scene scene = crowd_on_kilobot_medium(seed);
        check_placed_alike(scene.def);
    }
}

TEST_CASE("a robot is turned where it stands, also between others") {
    Scene scene(square_hall(4));
    scene.add("puppet", {{{0, 0}, 0}, {{0.17, 0}, 0}, {{-0.17, 0}, 0}});
    scene.motors(0, 0, FULL, FULL);
    Simulation simulation(scene.def);
    simulation.advance(20);
    const Samples before = simulation.snapshot();
    simulation.turn(0, 5);
    const Samples after = simulation.snapshot();
    CHECK(after.x_m == before.x_m);
    CHECK(after.y_m == before.y_m);
    CHECK(after.heading_rad[0] == doctest::Approx(5 - 2 * 3.14159265));
    simulation.advance(60);
    CHECK(simulation.snapshot().y_m[0] < after.y_m[0]);
    CHECK_THROWS_AS(simulation.turn(3, 0.0), EngineError);
}

TEST_CASE("a robot is heard where it is put, and not where it was") {
    for (const bool kilobot : {false, true}) {
        CAPTURE(kilobot);
        Scene scene(square_hall(10));
        scene.def.range_m = 0.5;
        if (kilobot) scene.def.kilobot_medium = infrared_settings();
        if (kilobot) scene.def.kilobot_medium->range_m = 0.5;
        scene.add("sender", {{{-4, 0}, 0}});
        scene.add("wanderer", {{{-4, 0.3}, 0}});
        scene.def.sample_ticks = 50;
        Simulation simulation(scene.def);
        auto received_in = [&](int64_t duration_ticks) {
            const uint64_t before = simulation.statistics().medium.received;
            simulation.advance(duration_ticks);
            return simulation.statistics().medium.received - before;
        };
        CHECK(received_in(100) > 0);
        simulation.place(0, {{4, 0}, 1});
        CHECK(simulation.snapshot().x_m[0] == 4);
        received_in(8);  // what is on air is received
        CHECK(received_in(100) == 0);
        const float x = simulation.snapshot().x_m[1], y = simulation.snapshot().y_m[1];
        simulation.place(0, {{double{x} + 0.3, double{y}}, 1});
        CHECK(received_in(100) > 0);
    }
}

TEST_CASE("a place that is taken, beyond a wall or no robot's is refused and changes nothing") {
    Scene scene(square_hall(2));
    scene.add("wanderer", {{{-0.5, 0}, 0}, {{0.5, 0}, 0}});
    Simulation simulation(scene.def);
    const uint64_t before = simulation.result_hash();
    CHECK_THROWS_WITH_AS(simulation.place(0, {{0.49, 0}, 0}), "robot 0 has no room there",
                         EngineError);
    CHECK_THROWS_AS(simulation.place(0, {{1, 0}, 0}), EngineError);
    CHECK_THROWS_AS(simulation.place(0, {{7, 0}, 0}), EngineError);
    CHECK_THROWS_WITH_AS(simulation.place(2, {{0, 0}, 0}), "there is no robot 2", EngineError);
    CHECK(simulation.result_hash() == before);
    simulation.place(0, {{-0.49, 0}, 0});
    CHECK(simulation.result_hash() != before);
}

}  // namespace test_placed_robots
