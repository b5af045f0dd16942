#include "simulation/simulation.h"

#include <doctest/doctest.h>

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <tuple>

#include "base/errors.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_simulation {

TEST_CASE("time starts at RUN and advances to the end of a world step") {
    for (uint32_t step : {1u, 2u, 4u}) {
        Scene scene(square_hall(6));
        scene.def.step_ticks = step;
        scene.add("puppet", {{{0, 0}, 0}});
        Simulation simulation(scene.def);
        CHECK(simulation.tick() == 0);
        simulation.advance(1);
        CHECK(simulation.tick() == step);
        simulation.advance(9);
        CHECK(simulation.tick() >= step + 9);
        CHECK(simulation.tick() < step + 9 + step);
        CHECK(simulation.tick() % step == 0);
    }
}

TEST_CASE("samples have motors, battery and messages if asked to, which changes no result") {
    auto scene_with = [](bool extras) {
        Scene scene(square_hall(6));
        scene.def.sample_ticks = 50;
        scene.def.battery_h = 0.001;  // 3.6 s of driving
        scene.def.sample_extras = {extras, extras, extras};
        scene.add("puppet", {{{0, 0}, 0}});
        scene.add("sender", {{{0.5, 0}, 0}, {{-2.9, 0}, 0}});  // the last one out of range
        scene.motors(20, 0, 70, 60);
        scene.motors(70, 0, 0, 0);
        return scene;
    };
    Simulation plain(scene_with(false).def), simulation(scene_with(true).def);
    plain.advance(110);
    simulation.advance(110);
    CHECK(plain.take_samples().battery.empty());
    CHECK(plain.result_hash() == simulation.result_hash());
    CHECK(plain.snapshot({true, true, true}).sent == simulation.snapshot().sent);

    const Samples samples = simulation.take_samples();
    REQUIRE(samples.tick == std::vector<int64_t>{0, 50, 100});
    auto at = [](const auto &column, size_t sample, size_t robot) {
        return static_cast<int>(column[3 * sample + robot]);
    };
    for (size_t sample : {0u, 1u, 2u}) {
        CHECK(at(samples.left_duty, sample, 0) == (sample == 1 ? 70 : 0));
        CHECK(at(samples.right_duty, sample, 0) == (sample == 1 ? 60 : 0));
        CHECK(at(samples.left_duty, sample, 1) == 0);
        CHECK(at(samples.sent, sample, 0) == 0);
        CHECK(at(samples.received, sample, 0) == at(samples.sent, sample, 1));
        CHECK(at(samples.received, sample, 1) == 0);
    }
    CHECK(at(samples.battery, 0, 1) > 700);
    CHECK(at(samples.battery, 1, 0) < at(samples.battery, 1, 1));  // it drives
    CHECK(at(samples.battery, 2, 0) < at(samples.battery, 1, 0));
    CHECK(at(samples.sent, 2, 1) > at(samples.sent, 1, 1));
    const auto medium = simulation.statistics().medium;
    const auto frames = simulation.frames();
    CHECK(frames[1].sent + frames[2].sent == medium.sent);
    CHECK(frames[0].received == medium.received);
}

TEST_CASE("samples are taken at 0 and at every period, however the run is cut") {
    Scene scene(square_hall(6));
    scene.def.sample_ticks = 25;
    scene.add("puppet", {{{0, 0}, 0}, {{1, 0}, 1}});
    scene.motors(0, 0, FULL, FULL);
    scene.tell(30, 1, message(COLOR, {RGB(1, 2, 3)}));
    Simulation whole(scene.def), cut(scene.def);
    whole.advance(110);
    auto samples = whole.take_samples();
    CHECK(samples.tick == std::vector<int64_t>{0, 26, 50, 76, 100});  // at the ends of world steps
    REQUIRE(samples.x_m.size() == 10);
    for (size_t row = 0; row < 5; row++) {
        CHECK(samples.x_m[2 * row] ==
              doctest::Approx(0.1 * TICK_S * static_cast<double>(samples.tick[row])));
        CHECK(samples.led[2 * row + 1] == (row < 2 ? 0 : RGB(1, 2, 3)));
    }
    CHECK(whole.take_samples().tick.empty());

    Samples joined;
    for (int i = 0; i < 37; i++) {
        cut.advance(i % 5);
        auto part = cut.take_samples();
        joined.tick.insert(joined.tick.end(), part.tick.begin(), part.tick.end());
        joined.x_m.insert(joined.x_m.end(), part.x_m.begin(), part.x_m.end());
        joined.led.insert(joined.led.end(), part.led.begin(), part.led.end());
    }
    joined.tick.resize(4);
    CHECK(joined.tick == std::vector<int64_t>{0, 26, 50, 76});
    for (size_t i = 0; i < 8; i++) {
        CHECK(joined.x_m[i] == samples.x_m[i]);
        CHECK(joined.led[i] == samples.led[i]);
    }
}

TEST_CASE("a snapshot shows now and disturbs nothing") {
    Scene scene(square_hall(6));
    scene.def.arena.sites = {{Region::Shape::CIRCLE, {0.5, 0}, {0.4, 0.4}}};
    scene.add("puppet", {{{0, 0}, 0.5}, {{0.5, 0.1}, -2}});
    Simulation simulation(scene.def);
    auto now = simulation.snapshot();
    CHECK(now.tick == std::vector<int64_t>{0});
    CHECK(now.heading_rad == std::vector<float>{0.5f, -2});
    CHECK(now.site == std::vector<uint8_t>{0, 1});
    CHECK(simulation.take_samples().tick == std::vector<int64_t>{0});
    simulation.advance(2);
    CHECK(simulation.take_samples().tick.empty());
}

TEST_CASE("a period of any length gives one sample at the end of each step in which one is due") {
    constexpr int64_t END = 120;
    for (uint32_t step : {1u, 2u, 4u})
        for (uint32_t period = 1; period <= 9; period++) {
            CAPTURE(step);
            CAPTURE(period);
            Scene scene(square_hall(6));
            scene.def.step_ticks = step;
            scene.def.sample_ticks = period;
            scene.add("wanderer", {{{0, 0}, 0}, {{1, 0}, 1}});
            std::set<int64_t> due;
            for (int64_t tick = 0; tick <= END; tick += period)
                due.insert((tick + step - 1) / step * step);
            due.erase(due.upper_bound(END), due.end());
            std::set<uint64_t> hashes;
            for (int64_t cut : {1, 2, 3, 5, 7, 120}) {
                Simulation simulation(scene.def);
                std::vector<int64_t> taken = simulation.take_samples().tick;
                while (simulation.tick() < END) {
                    simulation.advance(std::min(cut, END - simulation.tick()));
                    for (int64_t tick : simulation.take_samples().tick) taken.push_back(tick);
                    simulation.advance(0);
                }
                CHECK(taken == std::vector<int64_t>(due.begin(), due.end()));
                hashes.insert(simulation.result_hash());
            }
            CHECK(hashes.size() == 1);
        }
}

TEST_CASE("events are handed out up to now, however the run is cut") {
    Scene scene(round_hall(1));
    scene.def.kilobot_medium = infrared_settings();
    scene.add_anywhere("talker", 6);
    auto events_of = [&scene](int64_t cut) {
        Simulation simulation(scene.def);
        std::vector<std::tuple<Cycles, uint32_t, std::string>> all;
        while (simulation.tick() < 4000) {
            simulation.advance(std::min(cut, 4000 - simulation.tick()));
            for (const Event &event : simulation.take_events()) {
                CHECK(event.at < simulation.now());
                all.emplace_back(event.at, event.robot, event.text);
            }
        }
        return all;
    };
    const auto whole = events_of(4000);
    CHECK(whole.size() > 20);
    CHECK(std::is_sorted(whole.begin(), whole.end()));
    CHECK(events_of(1) == whole);
    CHECK(events_of(37) == whole);
}

TEST_CASE("commands are given at their tick, to the robots in their range of uids") {
    Scene scene(square_hall(6));
    scene.def.sample_ticks = 2;
    scene.add("puppet", {{{-1, 0}, 0}, {{0, 0}, 0}, {{1, 0}, 0}, {{2, 0}, 0}});
    scene.def.commands.push_back({10, 2, 3, message(COLOR, {RGB(0, 0, 3)})});
    scene.tell_all(-20, message(COLOR, {RGB(1, 1, 1)}));
    Simulation simulation(scene.def);
    simulation.advance(20);
    auto samples = simulation.take_samples();
    REQUIRE(samples.tick.size() == 11);
    for (size_t row = 1; row < samples.tick.size(); row++)  // at 0 the robots are still IDLE
        for (size_t robot = 0; robot < 4; robot++) {
            bool told = samples.tick[row] > 10 && (robot == 1 || robot == 2);
            CHECK(samples.led[4 * row + robot] == (told ? RGB(0, 0, 3) : RGB(1, 1, 1)));
        }
}

TEST_CASE("motors act exactly at the cycle they are set, also within a world step") {
    for (uint32_t step : {1u, 2u, 4u}) {
        Scene scene(square_hall(6));
        scene.def.step_ticks = step;
        scene.add("puppet", {{{0, 0}, 0}});
        scene.motors(3, 0, FULL, FULL);
        scene.motors(6, 0, 0, 0);
        scene.motors(9, 0, 65, 0);
        scene.motors(14, 0, 0, 0);
        Simulation simulation(scene.def);
        simulation.advance(20);
        Pose pose = pose_of(simulation.snapshot(), 0);
        CHECK(pose.position.x() == doctest::Approx(0.1 * 3 * TICK_S).epsilon(1e-6));
        CHECK(pose.heading == doctest::Approx(1.43 * 5 * TICK_S).epsilon(1e-6));
    }
}

TEST_CASE("what cannot be run is refused with words for people") {
    Scene empty(square_hall(6));
    CHECK_THROWS_WITH_AS(Simulation{empty.def}, "there is no robot", EngineError);

    Scene full(square_hall(0.5));
    full.add_anywhere("puppet", 50);
    CHECK_THROWS_AS(Simulation{full.def}, EngineError);

    Scene missing(square_hall(6));
    missing.add("no_such_program", {{{0, 0}, 0}});
    CHECK_THROWS_AS(Simulation{missing.def}, EngineError);
    CHECK_THROWS_WITH(Simulation{missing.def},
                      doctest::Contains("program no_such_program cannot be loaded"));

    Scene stranger(square_hall(6));
    stranger.add("puppet", {{{0, 0}, 0}});
    stranger.def.groups[0].program = "libm.so.6";
    CHECK_THROWS_WITH_AS(Simulation{stranger.def},
                         "program puppet cannot be loaded: No such file or directory", EngineError);

    Scene box(square_hall(6));
    box.add("puppet", {{{0, 0}, 0}});
    box.def.black_box = "/nowhere/at/all";
    CHECK_THROWS_AS(Simulation{box.def}, EngineError);
}

TEST_CASE("the black box tells which robot ran last, and its tick") {
    char path[] = "/tmp/kilotwin-black-box-XXXXXX";
    int file = mkstemp(path);
    REQUIRE(file >= 0);
    REQUIRE(ftruncate(file, sizeof(BlackBox)) == 0);
    Scene scene(square_hall(6));
    scene.def.black_box = path;
    scene.add("puppet", {{{-1, 0}, 0}, {{0, 0}, 0}, {{1, 0}, 0}});
    scene.tell(100, 1, message(COLOR, {1}));
    {
        Simulation simulation(scene.def);
        simulation.advance(102);
        BlackBox box;
        REQUIRE(pread(file, &box, sizeof box, 0) == sizeof box);
        CHECK(box.shares == 1);
        CHECK(box.share[0].robot < 3);
        CHECK(box.share[0].tick > 40);
        CHECK(box.share[0].tick <= 64 + 102);
    }
    close(file);
    std::remove(path);
}

TEST_CASE("equal definitions give equal runs, other seeds others") {
    auto hash_of = [](uint64_t seed) {
        Scene scene(round_hall(3), seed);
        scene.add_anywhere("wanderer", 20);
        Simulation simulation(scene.def);
        simulation.advance(2000);
        return final_hash(simulation.snapshot());
    };
    CHECK(hash_of(1) == hash_of(1));
    CHECK(hash_of(1) != hash_of(2));
}

TEST_CASE("two runs in one process do not disturb each other") {
    auto make = [](uint64_t seed) {
        Scene scene(round_hall(3), seed);
        scene.add_anywhere("wanderer", 20);
        return scene.def;
    };
    Simulation alone(make(1));
    alone.advance(1000);
    Simulation first(make(1)), second(make(2));
    for (int i = 0; i < 100; i++) {
        first.advance(10);
        second.advance(10);
    }
    CHECK(final_hash(first.snapshot()) == final_hash(alone.snapshot()));
}

}  // namespace test_simulation
