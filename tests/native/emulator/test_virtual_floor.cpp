// CELL messages tell robots of the floor: on change, at least every 16 ticks, each control step of
// 3 ticks.
#include "infrared/virtual_floor.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "base/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_virtual_floor {

namespace {

struct Told {
    int64_t tick;
    uint8_t site, flags;
};

/// A scene with a floor; robots say what they hear.
Scene floor_scene(const Arena &arena, uint32_t step_ticks) {
    Scene scene(arena);
    scene.def.floor = floor_settings();
    scene.def.step_ticks = step_ticks;
    scene.tell_all(-1, message(SAY, {1}));
    return scene;
}

std::vector<Told> told(const Simulation &simulation, const Events &events, uint32_t robot) {
    std::vector<Told> out;
    for (const auto &event : events) {
        if (event.robot != robot) continue;
        int type = 0, site = 0, flags = 0;
        REQUIRE(std::sscanf(event.text.c_str(), "%d: %d %d", &type, &site, &flags) == 3);
        CHECK(type == WIRE_TYPE_CELL);
        out.push_back({simulation.tick_of(event.at), static_cast<uint8_t>(site),
                       static_cast<uint8_t>(flags)});
    }
    return out;
}

/// Whether a control step, every third tick, fell into the world step that ends at `tick`.
bool sensed_at(int64_t tick, int64_t step) {
    return tick % step == 0 && (tick == 0 || tick / 3 != (tick - step) / 3);
}

}  // namespace

TEST_CASE("control steps of 3 ticks are sensed at the world step they fall into") {
    for (uint32_t step : {1u, 2u, 4u}) {
        VirtualFloor floor(floor_settings(), ticks(64), ticks(step), 1);
        for (uint64_t tick = 0; tick < 200; tick += step) {
            CAPTURE(tick);
            CHECK(floor.senses_at(ticks(64 + tick)) == sensed_at(static_cast<int64_t>(tick), step));
            uint64_t next = tick + step;
            while (!sensed_at(static_cast<int64_t>(next), step)) next += step;
            CHECK(floor.next_sensing(ticks(64 + tick)) == ticks(64 + next));
        }
        CHECK_FALSE(floor.senses_at(ticks(32)));
        CHECK(floor.next_sensing(ticks(32)) == ticks(64));
    }
}

TEST_CASE("with nothing new a robot is told at least every 16 ticks") {
    for (uint32_t step : {1u, 2u, 4u}) {
        auto scene = floor_scene(square_hall(6), step);
        scene.add("puppet", {{{0, 0}, 0}});
        Simulation simulation(scene.def);
        simulation.advance(400);
        auto all = told(simulation, simulation.take_events(), 0);
        REQUIRE(all.size() >= 25);
        CHECK(all.size() <= 400 / 12);
        CHECK(all[0].tick == 0);
        for (size_t i = 0; i < all.size(); i++) {
            CHECK(sensed_at(all[i].tick, step));
            if (i > 0) {
                CHECK(all[i].tick - all[i - 1].tick <= 16);
            }
            CHECK((all[i].site == 0 && all[i].flags == 0));
        }
    }
}

TEST_CASE("a robot is told of a site within a control step of crossing its edge") {
    for (uint32_t step : {1u, 2u, 4u}) {
        CAPTURE(step);
        auto scene = floor_scene(square_hall(8), step);
        scene.def.arena.sites = {{Region::Shape::CIRCLE, {0.5, 0}, {0.4, 0.4}},
                                 {Region::Shape::RECTANGLE, {1.2, 0}, {0.2, 3}}};
        scene.add("puppet", {{{0, 0}, 0}});
        scene.motors(0, 0, FULL, FULL);
        Simulation simulation(scene.def);
        simulation.advance(800);
        const double edges[] = {0.3, 0.7, 1.1, 1.3};
        const uint8_t sites[] = {0, 1, 0, 2, 0};
        size_t next = 0;
        for (const auto &now : told(simulation, simulation.take_events(), 0)) {
            double x = 0.1 * TICK_S * static_cast<double>(now.tick);
            if (now.site == sites[next]) continue;
            REQUIRE(next < 4);
            CHECK(now.site == sites[next + 1]);
            double late_ticks = (x - edges[next]) / (0.1 * TICK_S);
            CHECK(late_ticks >= -1e-9);
            CHECK(late_ticks <= 3 + step);
            next++;
        }
        CHECK(next == 4);
    }
}

TEST_CASE(
    "an obstacle is a wall or robot within 50 mm, surface to surface, in the front half-plane") {
    struct Case {
        Eigen::Vector2d other;
        double heading;
        bool obstacle;
    };
    const Case cases[] = {
        {{0.219, 0}, 0, true},
        {{0.221, 0}, 0, false},
        {{0.219, 0}, PI, false},
        {{0.219, 0}, PI / 2 - 0.01, true},
        {{0.219, 0}, PI / 2 + 0.01, false},
        {{-0.15, 0.15}, PI / 2, true},
    };
    for (const auto &c : cases) {
        CAPTURE(c.other.x());
        CAPTURE(c.heading);
        auto scene = floor_scene(square_hall(6), 2);
        scene.add("puppet", {{{0, 0}, c.heading}, {c.other, 0}});
        Simulation simulation(scene.def);
        simulation.advance(20);
        auto all = told(simulation, simulation.take_events(), 0);
        REQUIRE(!all.empty());
        CHECK((all[0].flags == WIRE_CELL_OBSTACLE) == c.obstacle);
        CHECK((all[0].flags & ~WIRE_CELL_OBSTACLE) == 0);
    }
}

TEST_CASE("walls are obstacles on every side, round or straight") {
    for (int i = 0; i < 16; i++) {
        double angle = i * PI / 8;
        for (bool round : {true, false}) {
            auto scene = floor_scene(round ? round_hall(4) : square_hall(4), 2);
            Eigen::Vector2d outward = direction(angle);
            double wall = round ? 2 : 2 / outward.cwiseAbs().maxCoeff();
            // Straight walls are met at an angle: what counts is the distance to the wall.
            double cosine = round ? 1 : outward.cwiseAbs().maxCoeff();
            auto at = [&](double gap) {
                return Eigen::Vector2d(outward * (wall - (0.085 + gap) / cosine));
            };
            scene.add("puppet", {{at(0.049), angle}});
            scene.add("puppet", {{-at(0.051), angle + PI}});
            Simulation simulation(scene.def);
            simulation.advance(4);
            auto events = simulation.take_events();
            CHECK(told(simulation, events, 0)[0].flags == WIRE_CELL_OBSTACLE);
            CHECK(told(simulation, events, 1)[0].flags == 0);
        }
    }
}

TEST_CASE("an approaching wall is told of within a control step, and when one has turned away") {
    for (uint32_t step : {1u, 2u, 4u}) {
        auto scene = floor_scene(square_hall(4), step);
        scene.add("puppet", {{{1.5, 0}, 0}});
        scene.motors(0, 0, FULL, FULL);
        scene.motors(112, 0, 0, 0);
        scene.motors(120, 0, 65, 0);
        scene.motors(160, 0, 0, 0);  // 1.87 rad: away from the wall
        Simulation simulation(scene.def);
        simulation.advance(200);
        // 0.365 m to go at 0.1 m/s: tick 111.4.
        bool obstacle = false;
        int64_t met = 0, lost = 0;
        for (const auto &now : told(simulation, simulation.take_events(), 0)) {
            if (now.flags && !obstacle) met = now.tick;
            if (!now.flags && obstacle) lost = now.tick;
            obstacle = now.flags;
        }
        CHECK(met >= 112);
        CHECK(met <= 112 + 3 + step);
        CHECK_FALSE(obstacle);
        // A quarter turn takes 33.5 ticks.
        CHECK(lost >= 153);
        CHECK(lost <= 154 + 3 + step);
    }
}

TEST_CASE("a robot at rest gets a message when another drives up to it") {
    for (uint32_t step : {1u, 2u, 4u}) {
        auto scene = floor_scene(square_hall(6), step);
        scene.add("puppet", {{{0, 0}, 0}, {{1, 0}, PI}});
        scene.motors(0, 1, FULL, FULL);
        Simulation simulation(scene.def);
        simulation.advance(240);
        // 0.78 m to go: tick 238.
        auto all = told(simulation, simulation.take_events(), 0);
        for (const auto &now : all) CHECK(now.flags == 0);
        simulation.advance(12);
        all = told(simulation, simulation.take_events(), 0);
        REQUIRE(!all.empty());
        CHECK(all.back().flags == WIRE_CELL_OBSTACLE);
        for (const auto &now : all)
            if (now.flags) {
                CHECK(now.tick >= 238);
                CHECK(now.tick <= 239 + 3 + step);
                break;
            }
    }
}

}  // namespace test_virtual_floor
