// Beacons in objects: heard by the robots in range, as a robot's messages are.
#include <doctest/doctest.h>

#include <cmath>

#include "base/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_beacons {

namespace {

/// Adds a disc that sends every `period_ticks`. Without friction it would slide for ever.
void add_beacon(Scene &scene, const Eigen::Vector2d &place, int64_t period_ticks,
                double radius_m = 0.02) {
    const auto object = static_cast<uint32_t>(scene.def.objects.size());
    scene.def.objects.push_back(
        {{{{0, 0}, radius_m, {}}}, Pose{place, 0.5}, 0.002, 0.02, 0.02, 0.3});
    scene.def.beacons.push_back({object, message(0x11, {1, 2, 3}), ticks(period_ticks)});
}

/// Kilobots, with the infrared of Kilobots or the ideal one.
Scene kilobots(bool ideal, uint64_t seed = 1) {
    Scene scene(square_hall(1), seed);
    scene.def.profile = small_robot();
    scene.def.profile.speed_m_s = 0.013;
    scene.def.profile.legs = true;
    scene.def.step_ticks = 4;
    scene.def.range_m = 0.1;
    scene.def.line_of_sight = false;
    if (!ideal) scene.def.kilobot_medium = infrared_settings();
    return scene;
}

ChannelCounts counts_after(const Scene &scene, int64_t duration_ticks) {
    Simulation simulation(scene.def);
    simulation.advance(duration_ticks);
    return simulation.statistics().medium;
}

}  // namespace

TEST_CASE("a beacon is heard by the robots in range, once a period") {
    for (bool ideal : {false, true}) {
        CAPTURE(ideal);
        Scene scene = kilobots(ideal);
        // They say nothing. Two are in range.
        scene.add("puppet", {{{0.04, 0}, 0}, {{0, 0.099}, 0}, {{0.101, 0}, 0}});
        if (!ideal) {
            auto &exact = *scene.def.kilobot_medium;
            exact.loss = exact.loss_at_range = exact.range_spread = 0;
        }
        add_beacon(scene, {0, 0}, 20);
        const auto counts = counts_after(scene, 20 * 100);
        CHECK(std::abs(static_cast<double>(counts.received) - 200) <= 4);
        CHECK(counts.attempts_failed == 0);
    }
}

TEST_CASE("walls that block light hide a beacon") {
    for (bool ideal : {false, true})
        for (bool blocks : {false, true}) {
            CAPTURE(ideal);
            CAPTURE(blocks);
            Scene scene = kilobots(ideal);
            const Region plate = {Region::Shape::RECTANGLE, {0.03, 0}, {0.004, 0.2}};
            scene.def.arena.obstacles = {{plate, blocks}};
            scene.def.arena.build_walls(false, 0.2);
            scene.add("puppet", {{{0.06, 0}, 0}});
            add_beacon(scene, {0, 0}, 10);
            const auto counts = counts_after(scene, 1000);
            CHECK((blocks ? counts.received == 0 : counts.received > 80));
        }
}

TEST_CASE("a beacon moves with its object") {
    Scene scene = kilobots(true);
    scene.def.profile = foot_bot();
    scene.add("puppet", {{{-0.2 - 0.085, 0}, 0}, {{0.4, 0.3}, 0}});
    scene.motors(0, 0, FULL, FULL);
    add_beacon(scene, {0, 0}, 10, 0.2);
    scene.def.range_m = 0.35;
    Simulation simulation(scene.def);
    simulation.advance(10);
    const uint64_t before = simulation.statistics().medium.received;
    CHECK(before <= 2);  // the robot that pushes
    simulation.advance(150);
    const double moved_m = simulation.snapshot().object_x_m[0];
    CHECK(moved_m > 0.3);
    // Both robots, since the object has come near the other one.
    CHECK(simulation.statistics().medium.received > before + 15 + 3);
}

TEST_CASE("a beacon puts off sending while it receives, and then tries again") {
    Scene scene = kilobots(false);
    std::vector<Pose> poses;
    for (int i = 0; i < 24; i++) poses.push_back({0.08 * direction(0.26 * i - PI), 0});
    scene.def.clock_spread = 0.01;
    scene.add("talker", poses);
    Scene quiet = scene;
    add_beacon(scene, {0, 0}, 1);
    const auto alone = counts_after(quiet, 4000), crowded = counts_after(scene, 4000);
    // Of 4,000 ticks those in which a robot's light falls on it are lost to it.
    const auto sent = static_cast<double>(crowded.sent) - static_cast<double>(alone.sent);
    MESSAGE("a beacon among 24 talkers sends " << sent << " frames in 4,000 ticks");
    CHECK(sent < 3600);
    CHECK(sent > 2000);
    CHECK(crowded.collided > alone.collided);
}

TEST_CASE("with beacons a world is the same run ahead and tick by tick") {
    for (bool ideal : {false, true})
        for (uint64_t seed = 1; seed <= 3; seed++) {
            CAPTURE(ideal);
            CAPTURE(seed);
            Scene scene = kilobots(ideal, seed);
            scene.add_anywhere("wanderer", 30);
            for (int i = 0; i < 3; i++) add_beacon(scene, {0.2 * i - 0.2, 0.1}, 7 + 11 * i);
            uint64_t hashes[2];
            for (bool ahead : {false, true}) {
                scene.def.run_ahead = ahead;
                Simulation simulation(scene.def);
                simulation.advance(2000);
                hashes[ahead] = simulation.result_hash();
                CHECK(simulation.statistics().medium.received > 100);
            }
            CHECK(hashes[0] == hashes[1]);
        }
}

}  // namespace test_beacons
