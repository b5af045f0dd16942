#include <doctest/doctest.h>

#include <cmath>
#include <deque>
#include <memory>
#include <stdexcept>

#include "robots/trail.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_kilobot_channel {

namespace {

/// Talkers that stand still, heard without loss or noise unless a test asks for it.
Scene talkers(const std::vector<Eigen::Vector2d> &places, uint64_t seed = 1) {
    Scene scene(square_hall(3), seed);
    scene.def.profile = small_robot();
    scene.def.profile.legs = true;
    auto exact = infrared_settings();
    exact.range_spread = exact.loss = exact.loss_at_range = exact.gain_noise_lsb = 0;
    scene.def.kilobot_medium = exact;
    scene.def.clock_spread = 0.01;
    std::vector<Pose> poses;
    for (const auto &place : places) poses.push_back({place, 0});
    scene.add("talker", poses);
    return scene;
}

ChannelCounts counts_after(const Scene &scene, double duration_s) {
    Simulation simulation(scene.def);
    simulation.advance(static_cast<int64_t>(duration_s / TICK_S));
    return simulation.statistics().medium;
}

/// Notes whose frame it is told of.
class Noting final : public Stations {
  public:
    double range_m(uint32_t /*station*/) const override { return 1; }
    void shine(Frame &frame) override { told.push_back(frame.sender); }

    std::vector<uint32_t> told;
};

constexpr double FRAME_S = static_cast<double>(FRAME_CYCLES) * CYCLE_S;
constexpr double PERIOD_S = 16 * TICK_S;

}  // namespace

TEST_CASE("a robot that always has something to say sends 1.91 frames a second") {
    auto counts = counts_after(talkers({{0, 0}, {0.05, 0}}), 600);
    CHECK(static_cast<double>(counts.sent) / 2 / 600 ==
          doctest::Approx(1 / PERIOD_S).epsilon(0.01));
    CHECK(counts.attempts_failed <= counts.sent / 100);
    CHECK(counts.received + counts.deaf + counts.collided == counts.sent);
    CHECK(static_cast<double>(counts.received) > 0.98 * static_cast<double>(counts.sent));
}

TEST_CASE("a robot out of range receives nothing") {
    auto counts = counts_after(talkers({{0, 0}, {0.1001, 0}}), 60);
    CHECK(counts.sent > 200);
    CHECK(counts.received == 0);
}

TEST_CASE("two senders hidden from one another spoil the share of frames that geometry says") {
    uint64_t frames = 0, collided = 0;
    for (uint64_t seed = 1; seed <= 10; seed++) {
        auto scene = talkers({{-0.09, 0}, {0, 0}, {0.09, 0}}, seed);
        // The one in the middle is no robot of a swarm that talks: it only listens.
        scene.def.commands.erase(scene.def.commands.begin());
        for (uint32_t robot : {0u, 2u}) scene.tell(0, robot, run_message());
        auto counts = counts_after(scene, 3000);
        frames += counts.sent;
        collided += counts.collided;
    }
    // A frame is spoilt if the other's began within a frame's time before or after it. Collisions
    // come in pairs and, as clocks drift past one another, in bursts: ten pairs of clocks give a
    // wide but honest bound.
    double share = static_cast<double>(collided) / static_cast<double>(frames);
    CHECK(share > 0);
    CHECK(share == doctest::Approx(2 * FRAME_S / PERIOD_S).epsilon(0.5));
}

TEST_CASE("a channel that is held busy makes ticks come at 58.7 Hz, and nothing goes out") {
    auto scene = talkers({{0, 0}});
    scene.def.clock_spread = 0;
    scene.def.kilobot_medium->held_busy = true;
    Simulation simulation(scene.def);
    simulation.advance(static_cast<int64_t>(120 / TICK_S));
    CHECK(simulation.statistics().medium.sent == 0);
    CHECK(simulation.statistics().medium.attempts_failed > 3000);
    auto said = texts(simulation.take_events(), 0);
    REQUIRE(said.size() >= 10);
    double ticks = std::stod(said[9]) - std::stod(said[0]);
    CHECK(ticks / 90 == doctest::Approx(58.7).epsilon(0.03));
}

TEST_CASE("25 robots in range of one another share the channel almost without loss") {
    std::vector<Eigen::Vector2d> places;
    for (int i = 0; i < 25; i++) places.emplace_back(0.035 * (i % 5), 0.035 * (i / 5));
    auto scene = talkers(places);
    scene.def.kilobot_medium->range_m = 0.3;
    auto counts = counts_after(scene, 300);
    double per_robot_s = static_cast<double>(counts.sent) / 25 / 300;
    CHECK(per_robot_s > 0.97 / PERIOD_S);
    CHECK(per_robot_s <= 1.011 / PERIOD_S);
    CHECK(static_cast<double>(counts.received) > 0.98 * 24 * static_cast<double>(counts.sent));
}

TEST_CASE("without carrier sense, collisions and deafness every frame is heard by all") {
    std::vector<Eigen::Vector2d> places;
    for (int i = 0; i < 25; i++) places.emplace_back(0.035 * (i % 5), 0.035 * (i / 5));
    auto scene = talkers(places);
    scene.def.kilobot_medium->range_m = 0.3;
    scene.def.kilobot_medium->collisions = false;
    scene.def.kilobot_medium->half_duplex = false;
    auto counts = counts_after(scene, 60);
    CHECK(counts.collided == 0);
    CHECK(counts.deaf == 0);
    CHECK(counts.received == 24 * counts.sent);
    // Each robot's own counts add up to them.
    Simulation simulation(scene.def);
    simulation.advance(static_cast<int64_t>(60 / TICK_S));
    uint64_t sent = 0, received = 0;
    for (const FrameCounts &robot : simulation.frames()) {
        sent += robot.sent;
        received += robot.received;
    }
    CHECK(sent == counts.sent);
    CHECK(received == counts.received);
}

TEST_CASE("losses by chance are as many as the settings say") {
    auto scene = talkers({{0, 0}, {0.05, 0}});
    scene.def.kilobot_medium->loss = 0.3;
    scene.def.kilobot_medium->loss_at_range = 0.3;
    auto counts = counts_after(scene, 3000);
    double heard = static_cast<double>(counts.received + counts.lost);
    double sd = std::sqrt(0.3 * 0.7 / heard);
    CHECK(std::abs(static_cast<double>(counts.lost) / heard - 0.3) < 4 * sd);
}

TEST_CASE("a Kilobot's world is the same run ahead and step by step, with all noise on") {
    Scene scene(square_hall(1), 7);
    scene.def.profile = small_robot();
    scene.def.profile.speed_m_s = 0.013;
    scene.def.profile.legs = true;
    scene.def.profile.speed_spread = 0.08;
    scene.def.profile.bias_spread = 0.2;
    scene.def.profile.motor_noise = 0.2;
    scene.def.kilobot_medium = infrared_settings();
    scene.def.clock_spread = 0.005;
    scene.add_anywhere("wanderer", 40);
    uint64_t hashes[2];
    for (bool ahead : {false, true}) {
        scene.def.run_ahead = ahead;
        Simulation simulation(scene.def);
        simulation.advance(2000);
        hashes[ahead] = final_hash(simulation.snapshot());
    }
    CHECK(hashes[0] == hashes[1]);
}

TEST_CASE("each of as many kinds of stations as can be numbered speaks for its own, and no more") {
    constexpr uint32_t OTHERS = 256 - 2;  // robots as guests and light from above are there
    const Arena arena = square_hall(1);
    const Chance chance(1);
    Team team;
    const Slots slots(0);
    Bodies bodies(arena, small_robot(), chance, slots, team, ticks(1), 0, {}, 0.1);
    Swarm<Robot> robots;
    const std::vector<Region> overhead;
    const std::unique_ptr<Trail> no_trail;
    KilobotChannel channel(infrared_settings(),
                           {chance, robots, bodies, team, ticks(1), true, overhead, no_trail},
                           OTHERS + 1, true, {});
    std::deque<Noting> kinds(OTHERS);
    for (uint32_t station = 0; station < OTHERS; station++)
        channel.assign(kinds[station], station, 1);
    for (uint32_t station = 0; station < OTHERS; station++)
        channel.begin_light(station, 0, run_message());
    for (uint32_t station = 0; station < OTHERS; station++)
        CHECK(kinds[station].told == std::vector<uint32_t>{station});
    Noting one_too_many;
    CHECK_THROWS_WITH_AS(channel.assign(one_too_many, OTHERS, 1),
                         "too many kinds of stations for FramesInFlight::Station::kind",
                         std::length_error);
    channel.assign(kinds[0], OTHERS, 1);  // a kind may have stations in several places
    channel.begin_light(OTHERS, 0, run_message());
    CHECK(kinds[0].told == std::vector<uint32_t>{0, OTHERS});
}

}  // namespace test_kilobot_channel
