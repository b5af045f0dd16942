// Threads that step a world: the team, and that a result never depends on how many there are.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>
#include <stdexcept>

#include "base/team.h"
#include "infrared/lanes.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_threads {

namespace {

/// All that a run's threads could get wrong.
struct Outcome {
    uint64_t hash;
    std::vector<std::string> events;
    uint64_t received, contacts;
    bool operator==(const Outcome &) const = default;
};

/// Done to a run each hundred ticks.
using Meddle = std::function<void(Simulation &, int64_t tick)>;

Outcome outcome_of(SimulationDef def, uint32_t threads, int64_t ticks, const Meddle &meddle) {
    def.threads = threads;
    Simulation simulation(def);
    Outcome outcome = {};
    for (int64_t done = 0; done < ticks; done += 100) {
        if (meddle) meddle(simulation, done);
        simulation.advance(100);
        for (const Event &event : simulation.take_events())
            // The address that a program is loaded to differs from run to run.
            outcome.events.push_back(std::to_string(event.at) + " " + std::to_string(event.robot) +
                                     " " + name_of(event.kind) + " " + text_without_address(event));
    }
    outcome.hash = simulation.result_hash();
    outcome.received = simulation.statistics().medium.received;
    outcome.contacts = simulation.statistics().overlaps.contacts();
    return outcome;
}

void check_threads(const Scene &scene, int64_t ticks, const Meddle &meddle = {}) {
    const Outcome one = outcome_of(scene.def, 1, ticks, meddle);
    for (const uint32_t threads : {2u, 3u, 8u}) {
        CAPTURE(threads);
        const Outcome several = outcome_of(scene.def, threads, ticks, meddle);
        CHECK(several.hash == one.hash);
        REQUIRE(several.events.size() == one.events.size());
        const auto [other, here] =
            std::mismatch(several.events.begin(), several.events.end(), one.events.begin());
        if (other != several.events.end()) CHECK(*other == *here);
        CHECK(several.received == one.received);
        CHECK(several.contacts == one.contacts);
    }
    MESSAGE(one.events.size() << " events, " << one.received << " frames, " << one.contacts
                              << " contacts");
}

/// Robots of many habits, close enough to meet.
Scene mixed_scene(uint64_t seed, double side_m) {
    Scene scene(square_hall(side_m), seed);
    scene.def.profile = small_robot();
    scene.def.clock_spread = 0.005;
    scene.def.range_m = 0.1;
    scene.def.sample_ticks = 77;
    scene.add_anywhere("wanderer", 60);
    scene.add_anywhere("sender", 20);
    scene.add_anywhere("talker", 20);
    scene.add_anywhere("seldom", 20);
    scene.add_anywhere("printer", 5);
    scene.add_anywhere("paused", 10);
    return scene;
}

/// Robots of many habits in two rows, numbered from one end to the other: most have neighbours of
/// their own share alone, and those at its borders do not.
Scene rows_scene(uint64_t seed) {
    Scene scene(square_hall(9), seed);
    scene.def.profile = small_robot();
    scene.def.kilobot_medium = infrared_settings();
    scene.def.sample_ticks = 77;
    const std::vector<std::string> programs = {"sender",   "wanderer", "sender",   "seldom",
                                               "wanderer", "talker",   "wanderer", "sender",
                                               "paused",   "wanderer", "patient",  "printer"};
    Dice dice(seed);
    for (int i = 0; i < 160; i++) {
        const double x = -4 + 0.1 * (i / 2) + dice.between(-0.01, 0.01),
                     y = 0.1 * (i % 2) + dice.between(-0.01, 0.01);
        const uint32_t robot =
            scene.add(programs[dice.below(static_cast<uint32_t>(programs.size()))],
                      {{{x, y}, dice.between(-3, 3)}});
        // Several requests in a step, of a sender; other habits of what is seldom asked.
        if (i % 3 == 0)
            scene.tell(20 + i, robot, message(0x30, {static_cast<uint8_t>(1 + i % 5), 0}));
        if (i % 4 == 0)
            scene.tell(30, robot, message(0x40, {static_cast<uint8_t>(dice.below(256) & ~4u)}));
    }
    return scene;
}

/// Whether robots of a scene are taken in several lanes when a run begins.
bool has_lanes(const Scene &scene, uint32_t threads) {
    const Samples samples = Simulation(scene.def).snapshot();
    std::vector<Eigen::Vector2d> places;
    for (uint32_t robot = 0; robot < samples.x_m.size(); robot++)
        places.push_back(pose_of(samples, robot).position);
    Team team(threads, nullptr);
    Neighbours lists(KilobotChannel::reach_m(*scene.def.kilobot_medium), 0.015, team);
    lists.rebuild(places);
    Lanes lanes(team, places.size());
    lanes.lists_changed(lists);
    return lanes.cut(lists, [](uint32_t) { return false; });
}

ObjectDef disc_at(const Pose &pose) {
    return {{ObjectPart{{0, 0}, 0.1, {}}}, pose, 0.02, 0.1, 0.1, 0.3};
}

}  // namespace

TEST_CASE("each share of a team is done once, in the blocks that robots belong to") {
    for (const uint32_t members : {1u, 2u, 3u, 7u}) {
        CAPTURE(members);
        Team team(members, nullptr);
        for (const bool alone : {false, true}) {
            team.work_alone(alone);
            for (const size_t count : {0u, 1u, 5u, 1000u}) {
                std::vector<int> done(count, 0);
                std::vector<uint32_t> by(count, 99);
                for (int turn = 0; turn < 50; turn++)
                    team.share(count, [&](uint32_t share, size_t begin, size_t end) {
                        for (size_t i = begin; i < end; i++) {
                            done[i]++;
                            by[i] = share;
                        }
                    });
                for (size_t i = 0; i < count; i++) {
                    REQUIRE(done[i] == 50);
                    REQUIRE(by[i] == team.share_of(i, count));
                }
            }
        }
    }
}

TEST_CASE("what a member of a team throws comes to the caller, and the team goes on") {
    Team team(3, nullptr);
    for (int turn = 0; turn < 3; turn++)
        CHECK_THROWS_WITH_AS(team.share([](uint32_t share) {
            if (share > 0) throw std::runtime_error("share " + std::to_string(share));
        }),
                             "share 1", std::runtime_error);
    std::atomic<uint32_t> sum = 0;
    team.share([&](uint32_t share) { sum += share; });
    CHECK(sum == 3);
}

TEST_CASE("a program has variables of its own for each share") {
    Program &one = Program::load(guest("wanderer"), "wanderer"),
            &other = Program::load(guest("wanderer"), "wanderer", 1);
    CHECK(one.table().state_begin != other.table().state_begin);
    CHECK(one.state_bytes() == other.state_bytes());
    CHECK(&one.stack() != &other.stack());
    CHECK(&other == &Program::load(guest("wanderer"), "wanderer", 1));
    CHECK_THROWS_AS(Program::load("/nowhere/at/all.so", "none", 1), EngineError);
}

TEST_CASE("one, two, three and eight threads give the same, with the ideal medium") {
    check_threads(mixed_scene(1, 1.5), 1500);
    Scene in_sight = mixed_scene(2, 0.9);
    in_sight.def.step_ticks = 4;
    in_sight.def.floor = floor_settings();
    check_threads(in_sight, 1000);
}

TEST_CASE("one, two, three and eight threads give the same, with the Kilobots' medium") {
    for (const uint64_t seed : {3, 4}) {
        Scene scene = mixed_scene(seed, seed == 3 ? 3 : 1);
        scene.def.kilobot_medium = infrared_settings();
        scene.def.profile.legs = true;
        scene.def.profile.motor_noise = 0.2;
        check_threads(scene, 1500);
    }
}

TEST_CASE("robots that reach those of other shares have the same results with any threads") {
    for (const uint64_t seed : {11, 12, 13}) {
        CAPTURE(seed);
        Scene scene = rows_scene(seed);
        for (const uint32_t threads : {2u, 3u, 8u}) REQUIRE(has_lanes(scene, threads));
        // Without a spread robots that were switched on together are asked at the same moments.
        scene.def.clock_spread = seed == 12 ? 0 : 0.005;
        scene.def.step_ticks = seed == 13 ? 1 : 4;
        using Kind = RobotFault::Kind;
        scene.def.faults = {{150, 20, Kind::DEAF, 0, 0},     {200, 40, Kind::MUTE, 0, 0},
                            {250, 80, Kind::DEAD, 0, 0},     {300, 79, Kind::DEAF, 0, 0},
                            {600, 20, Kind::RECEIVES, 0, 0}, {700, 40, Kind::TRANSMITS, 0, 0}};
        check_threads(scene, 1500);
    }
}

TEST_CASE("threads give the same where from some tick on one of them does the work of all") {
    Scene scene = rows_scene(14);
    REQUIRE(has_lanes(scene, 2));
    check_threads(scene, 1200, [](Simulation &simulation, int64_t tick) {
        if (tick == 500) simulation.keep_trail(10'000, false);
        if (tick % 400 == 200)
            simulation.shine_from_above(message(0x30, {2, 0}), simulation.now() + ticks(10) + 12345,
                                        0);
    });
}

TEST_CASE("what programs get is written down by threads as by one") {
    Scene scene = rows_scene(16);
    REQUIRE(has_lanes(scene, 2));
    auto heard_with = [&](uint32_t threads) {
        scene.def.threads = threads;
        Simulation simulation(scene.def);
        simulation.listen_to({1, 80, 157});
        simulation.advance(600);
        std::vector<std::string> heard;
        for (const uint32_t robot : {1u, 80u, 157u})
            for (const Heard &one : simulation.heard_by(robot))
                heard.push_back(std::to_string(robot) + " " + std::to_string(one.at) + " " +
                                std::to_string(one.message.type) + " " +
                                std::to_string(one.distance_mm));
        return heard;
    };
    const auto by_one = heard_with(1);
    for (const char *robot : {"1 ", "80 ", "157 "})
        CHECK(std::ranges::any_of(by_one, [&](auto &one) { return one.starts_with(robot); }));
    for (const uint32_t threads : {2u, 3u, 8u}) CHECK(heard_with(threads) == by_one);
}

TEST_CASE("threads give the same where robots are put elsewhere while their light is on") {
    Scene scene = rows_scene(15);
    const uint32_t first = scene.add("talker", {{{-4.3, 1}, 0}, {{4.3, 1}, 0}});
    REQUIRE(has_lanes(scene, 2));
    // As near the rows as there is room.
    auto put = [](Simulation &simulation, uint32_t robot, double x) {
        for (double y = 0.15;; y += 0.01) try {
                return simulation.place(robot, {{x, y}, 0});
            } catch (const EngineError &) {
            }
    };
    check_threads(scene, 1200, [&](Simulation &simulation, int64_t tick) {
        const double x = tick % 200 == 0 ? -3.5 : 3.5;
        put(simulation, first, x);
        put(simulation, first + 1, -x);
    });
}

TEST_CASE("with objects, lamps and failures threads give the same") {
    for (const bool kilobot : {false, true}) {
        CAPTURE(kilobot);
        Scene scene = mixed_scene(5, 1.5);
        if (kilobot) scene.def.kilobot_medium = infrared_settings();
        scene.def.objects = {disc_at({{0.3, 0.2}, 0}), disc_at({{-0.4, 0.1}, 1})};
        scene.def.light.sources = {{{0.2, 0.1}, 900, 0.5}};
        scene.add_anywhere("light_watcher", 5);
        using Kind = RobotFault::Kind;
        scene.def.faults = {{200, 3, Kind::DEAD, 0, 0},
                            {300, 70, Kind::DEAF, 0, 0},
                            {400, 90, Kind::MUTE, 0, 0},
                            {500, 20, Kind::MOTORS, 0.5, 1}};
        check_threads(scene, 1000);
    }
}

TEST_CASE("programs that crash, wait for ever and print are told by threads as by one") {
    Scene scene(square_hall(8), 6);
    scene.add_anywhere("crashes", 10);
    scene.add_anywhere("mistakes", 3);
    scene.add_anywhere("waiting", 5);
    scene.add_anywhere("restarts", 2);
    scene.add_anywhere("printer", 5);
    scene.add_anywhere("random", 5);
    check_threads(scene, 900);
}

TEST_CASE("more threads than robots are as many as robots") {
    Scene scene(square_hall(2), 7);
    scene.add_anywhere("wanderer", 3);
    check_threads(scene, 300);
}

TEST_CASE("of several threads the black box names the robots that run") {
    char path[] = "/tmp/kilotwin-black-box-XXXXXX";
    const int file = mkstemp(path);
    REQUIRE(file >= 0);
    REQUIRE(ftruncate(file, sizeof(BlackBox)) == 0);
    Scene scene(square_hall(6));
    scene.def.black_box = path;
    scene.def.threads = 2;
    scene.add_anywhere("wanderer", 8);
    {
        Simulation simulation(scene.def);
        simulation.advance(102);
        BlackBox box;
        REQUIRE(pread(file, &box, sizeof box, 0) == sizeof box);
        CHECK(box.shares == 2);
        CHECK(box.steps == simulation.statistics().steps);
        for (const int share : {0, 1}) CHECK(box.share[share].robot == BlackBox::NONE);
    }
    close(file);
    std::remove(path);
}

}  // namespace test_threads
