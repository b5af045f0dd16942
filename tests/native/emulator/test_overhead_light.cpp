// Light of an overhead controller on robots as guests: it meets their own talk, and chance.
#include <doctest/doctest.h>

#include <vector>

#include "base/message_crc.h"
#include "simulation/recorder.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_overhead_light {

namespace {

/// Robots that stand still, so near that all hear all, without loss or noise.
Scene standing(const std::string &program, uint32_t count, uint64_t seed = 1) {
    Scene scene(square_hall(3), seed);
    scene.def.profile = small_robot();
    scene.def.profile.legs = true;
    auto exact = infrared_settings();
    exact.range_spread = exact.loss = exact.loss_at_range = exact.gain_noise_lsb = 0;
    exact.range_m = 0.5;
    scene.def.kilobot_medium = exact;
    scene.def.clock_spread = 0.01;
    scene.def.step_ticks = 1;
    std::vector<Pose> poses;
    for (uint32_t i = 0; i < count; i++) poses.push_back({{0.05 * i, 0}, 0});
    scene.add(program, poses);
    return scene;
}

/// A frame each 10.4 ms for so many ticks.
constexpr Cycles PERIOD = 83'200;
void shine(Simulation &simulation, const message_t &what, int64_t for_ticks) {
    const Cycles begin = simulation.now(), end = begin + ticks(static_cast<uint64_t>(for_ticks));
    for (Cycles at = begin; at < end; at += PERIOD) simulation.shine_from_above(what, at);
    simulation.advance(for_ticks);
}

ChannelCounts counts(const Simulation &simulation) { return simulation.statistics().medium; }

}  // namespace

TEST_CASE("robots that say nothing hear every frame from above") {
    Simulation simulation(standing("puppet", 3).def);
    simulation.advance(4);
    shine(simulation, message(COLOR, {RGB(3, 0, 0)}), 40);
    simulation.advance(4);
    CHECK(counts(simulation).above_sent == 127);
    CHECK(counts(simulation).above_received == 3 * counts(simulation).above_sent);
    for (uint32_t robot = 0; robot < 3; robot++)
        CHECK(shown(simulation.robot(robot)) == RGB(3, 0, 0));
}

TEST_CASE("a share of the frames is lost by chance, at each robot for itself") {
    auto scene = standing("puppet", 10);
    scene.def.kilobot_medium->overhead_loss = 0.3;
    Simulation simulation(scene.def);
    shine(simulation, message(COLOR), 1000);
    const auto all = static_cast<double>(10 * counts(simulation).above_sent);
    CHECK(static_cast<double>(counts(simulation).above_received) / all ==
          doctest::Approx(0.7).epsilon(0.01));
    CHECK(counts(simulation).lost == 0);
}

TEST_CASE("robots that talk miss frames from above, and are put off by them") {
    const auto scene = standing("talker", 8);
    Simulation alone(scene.def), lit(scene.def);
    alone.advance(2000);
    shine(lit, message(COLOR), 2000);
    const double heard = static_cast<double>(counts(lit).above_received) /
                         static_cast<double>(8 * counts(lit).above_sent);
    // Light falls on them for 42 % of the time. Those that talk do it in the rest: 8 frames of 4.4
    // ms in 0.52 s each, of which most meet one from above.
    CHECK(heard < 0.97);
    CHECK(heard > 0.85);
    CHECK(counts(alone).collided < counts(alone).sent / 20);
    CHECK(counts(lit).received < 0.7 * static_cast<double>(counts(alone).received));
    CHECK(counts(lit).collided > counts(lit).received / 4);
}

TEST_CASE("without collisions and deafness talk and light from above pass one another") {
    auto scene = standing("talker", 8);
    scene.def.kilobot_medium->collisions = scene.def.kilobot_medium->half_duplex = false;
    Simulation simulation(scene.def);
    shine(simulation, message(COLOR), 500);
    simulation.advance(2);
    CHECK(counts(simulation).above_received == 8 * counts(simulation).above_sent);
    CHECK(counts(simulation).collided == 0);
}

TEST_CASE("frames from above do not overlap: the later ones wait, none is forgotten") {
    Simulation simulation(standing("puppet", 2).def);
    simulation.advance(4);
    for (int i = 0; i < 20; i++)
        simulation.shine_from_above(message(COLOR, {RGB(0, 3, 0)}), simulation.now());
    simulation.advance(1);
    CHECK(counts(simulation).above_sent < 20);
    simulation.advance(3);
    CHECK(counts(simulation).above_sent == 20);
    CHECK(counts(simulation).above_received == 40);
}

TEST_CASE("one with a wrong CRC is taken by no robot, and spoils talk all the same") {
    auto wrong = message(COLOR, {RGB(3, 0, 0)});
    wrong.crc ^= 1;
    Simulation simulation(standing("talker", 8).def);
    shine(simulation, wrong, 1000);
    CHECK(counts(simulation).above_received == 0);
    CHECK(counts(simulation).collided > 0);
}

TEST_CASE("under light from above, run ahead and tick by tick give the same") {
    for (uint32_t step_ticks : {1u, 2u, 4u}) {
        CAPTURE(step_ticks);
        std::vector<uint64_t> hashes;
        std::vector<ChannelCounts> totals;
        for (bool run_ahead : {true, false}) {
            Scene scene({{Region::Shape::RECTANGLE, {0, 0}, {0.5, 0.5}}, {}}, 7);
            scene.def.profile = small_robot();
            scene.def.kilobot_medium = infrared_settings();
            scene.def.kilobot_medium->overhead_loss = 0.1;
            scene.def.clock_spread = 0.005;
            scene.def.step_ticks = step_ticks;
            scene.def.run_ahead = run_ahead;
            scene.add_anywhere("wanderer", 12);
            scene.add_anywhere("talker", 3);
            Simulation simulation(scene.def);
            Dice dice(3);
            for (int i = 0; i < 40; i++) {
                const Cycles begin = simulation.now();
                for (uint32_t frame = dice.below(4); frame > 0; frame--)
                    simulation.shine_from_above(
                        message(static_cast<uint8_t>(dice.below(3))),
                        begin + static_cast<Cycles>(dice.between(0, 1.2) *
                                                    static_cast<double>(ticks(20))));
                simulation.advance(20);
            }
            hashes.push_back(final_hash(simulation.snapshot()));
            totals.push_back(counts(simulation));
        }
        CHECK(hashes[0] == hashes[1]);
        CHECK(totals[0].above_sent > 30);
        CHECK(totals[0].above_sent == totals[1].above_sent);
        CHECK(totals[0].above_received == totals[1].above_received);
        CHECK(totals[0].sent == totals[1].sent);
        CHECK(totals[0].received == totals[1].received);
        CHECK(totals[0].attempts_failed == totals[1].attempts_failed);
        CHECK(totals[0].collided == totals[1].collided);
        CHECK(totals[0].deaf == totals[1].deaf);
    }
}

TEST_CASE("with the ideal medium all robots receive each frame when it ends") {
    Scene scene(square_hall(3));
    scene.add("puppet", {{{0, 0}, 0}, {{1, 0}, 0}});
    Simulation simulation(scene.def);
    simulation.advance(4);
    simulation.shine_from_above(message(COLOR, {RGB(0, 0, 3)}), simulation.now() + ticks(8));
    simulation.advance(8);
    CHECK(shown(simulation.robot(0)) == 0);
    simulation.advance(4);
    CHECK(counts(simulation).above_received == 2);
    for (uint32_t robot = 0; robot < 2; robot++)
        CHECK(shown(simulation.robot(robot)) == RGB(0, 0, 3));
}

}  // namespace test_overhead_light
