// System messages: RUN, the pause that WAKEUP is, RESET, SLEEP.
#include <doctest/doctest.h>

#include "kilolib/core/timer.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_commands {

namespace {

using Texts = std::vector<std::string>;
using Motors = std::vector<std::pair<int, int>>;

Motors motors(Robot &robot) {
    Motors out;
    for (const auto &command : robot.motor_commands())
        out.emplace_back(command.left, command.right);
    robot.motor_commands().clear();
    return out;
}

}  // namespace

TEST_CASE("main() runs at power-up, setup() and loop() from RUN on") {
    Bench bench({"paused"});
    bench.run(ticks(12));
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0"});
    bench.tell(ticks(12) + 5, 0, run_message());
    bench.run(ticks(25));
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0", "setup at 12", "loop 9 at 20"});
    CHECK(shown(bench.robot(0)) == RGB(0, 3, 0));
    auto commands = bench.robot(0).motor_commands();
    REQUIRE(commands.size() == 1);
    CHECK(commands[0].left == 70);
    CHECK(commands[0].right == 70);
}

TEST_CASE("a second RUN changes nothing") {
    Bench bench({"paused"});
    bench.tell(ticks(1), 0, run_message());
    bench.tell(ticks(5), 0, run_message());
    bench.run(ticks(12));
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0", "setup at 1", "loop 10 at 10"});
    CHECK(motors(bench.robot(0)) == Motors{{70, 70}});
}

TEST_CASE("after a pause loop() goes on without setup(), the motors stay off until set again") {
    Bench bench({"paused"});
    bench.tell(ticks(1), 0, run_message());
    bench.tell(ticks(15) + 5, 0, message(WAKEUP));
    bench.run(ticks(30));
    CHECK(motors(bench.robot(0)) == Motors{{70, 70}, {0, 0}});
    bench.tell(ticks(35), 0,
               message(0x31));  // a callback that sets motors while paused: they are off
    bench.run(ticks(36));
    CHECK(motors(bench.robot(0)) == Motors{});
    bench.tell(ticks(45) + 5, 0, run_message());
    bench.run(ticks(55));
    CHECK(motors(bench.robot(0)) == Motors{});
    bench.tell(ticks(56), 0, message(0x31));
    bench.run(ticks(62));
    CHECK(motors(bench.robot(0)) == Motors{{70, 70}});
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0", "setup at 1", "loop 10 at 10",
                                 "heard 49 in loop 15", "loop 21 at 50", "heard 49 in loop 27",
                                 "loop 31 at 60"});
}

TEST_CASE("a pause during delay(): the call is finished, then loop() is called no more") {
    Bench bench({"timing"});
    bench.tell(10, 0, run_message());
    bench.run(ticks(20));
    size_t before = bench.said(0).size();
    bench.tell(ticks(20), 0, message(WAKEUP));
    bench.run(ticks(100));
    CHECK(bench.said(0).size() == before + 1);
    bench.tell(ticks(100), 0, run_message());
    bench.run(ticks(130));
    CHECK(bench.said(0).size() > before + 5);
    for (const auto &text : bench.said(0)) CHECK_FALSE(text.starts_with("deep 0"));
}

TEST_CASE("RESET runs main() again with memory as after power-up, motors and LED off") {
    Bench bench({"paused"});
    bench.tell(ticks(1), 0, run_message());
    bench.tell(ticks(15) + 5, 0, message(RESET));
    bench.run(ticks(40));
    CHECK(bench.said(0) ==
          Texts{"main, life 1, ticks 0", "setup at 1", "loop 10 at 10", "main, life 1, ticks 0"});
    CHECK(motors(bench.robot(0)) == Motors{{70, 70}, {0, 0}});
    CHECK(shown(bench.robot(0)) == 0);
    bench.tell(ticks(40), 0, run_message());
    bench.run(ticks(45));
    CHECK(bench.said(0).back() == "setup at 24");  // kilo_ticks began anew
}

TEST_CASE("RESET ends whatever the program does: a delay, an endless loop") {
    Bench bench({"timing", "waiting", "waiting", "waiting"});
    for (uint32_t robot : {0u, 2u, 3u}) {
        bench.tell(10, robot, run_message());
        bench.tell(ticks(5), robot, message(RESET));
    }
    bench.run(ticks(400));
    for (uint32_t robot : {0u, 2u, 3u}) {
        CHECK(bench.others(robot).empty());
        CHECK(bench.prints(robot).empty());
        bench.tell(ticks(400), robot, run_message());
    }
    bench.run(ticks(430));
    CHECK(bench.said(0).size() > 2);
}

TEST_CASE("messages reach the callback in every state, system messages never do") {
    Bench bench({"paused"});
    bench.tell(ticks(2), 0, message(0x40));  // IDLE
    bench.tell(ticks(3), 0, run_message());
    bench.tell(ticks(5), 0, message(0x7F));
    bench.tell(ticks(6), 0, message(VOLTAGE));
    bench.tell(ticks(7), 0, message(0x00));
    bench.run(ticks(9));
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0", "heard 64 in loop 0", "setup at 3",
                                 "heard 127 in loop 3", "heard 0 in loop 4"});
    CHECK(motors(bench.robot(0)) == Motors{{70, 70}, {0, 0}});
}

TEST_CASE("READUID turns left for a bit of the uid that is set, after a kick of 15 ms") {
    Bench bench({"paused"});
    bench.tell(ticks(2), 0, message(READUID, {0}));
    bench.run(ticks(5));
    const auto commands = bench.robot(0).motor_commands();
    REQUIRE(motors(bench.robot(0)) == Motors{{255, 0}, {65, 0}});
    CHECK(commands[1].at - commands[0].at == 15 * CYCLES_PER_MS);
    bench.tell(ticks(6), 0, message(READUID, {1}));
    bench.run(ticks(8));
    CHECK(motors(bench.robot(0)) == Motors{{0, 0}});
    bench.tell(ticks(8), 0, message(READUID, {16}));  // there are 16 bits only
    bench.run(ticks(10));
    CHECK(motors(bench.robot(0)) == Motors{});
}

TEST_CASE("CALIB, repeated, kicks the motors once; what it tries is saved after the trial") {
    Bench bench({"paused"});
    const auto trial = message(CALIB, {4, 0, 0, 0, 0, 73, 74});
    const auto save = message(CALIB, {0, 0x34, 0x12, 81, 82, 83, 84});
    bench.tell(ticks(1), 0, save);
    bench.run(ticks(2));
    CHECK(bench.robot(0).uid() == 1);
    for (uint32_t i = 0; i < 5; i++) bench.tell(ticks(2) + 83'200 * i, 0, trial);
    bench.run(ticks(5));
    CHECK(motors(bench.robot(0)) == Motors{{255, 255}, {73, 74}});
    bench.tell(ticks(5), 0, save);
    bench.run(ticks(6));
    CHECK(motors(bench.robot(0)) == Motors{{0, 0}});
    CHECK(bench.robot(0).uid() == 0x1234);
    bench.tell(ticks(6), 0, message(READUID, {2}));
    bench.run(ticks(8));
    CHECK(motors(bench.robot(0)) == Motors{{255, 0}, {81, 0}});
}

TEST_CASE("CALIB with a mark is for the robot of its uid alone") {
    Bench bench({"paused", "paused"});
    const auto trial = message(CALIB, {4, 2, 0, 0, 0, 73, 74, 'K', 'T'});
    const auto save = message(CALIB, {0, 2, 0, 81, 82, 83, 84, 'K', 'T'});
    for (uint32_t robot : {0, 1}) {
        bench.tell(ticks(1), robot, message(CALIB, {1}));
        bench.tell(ticks(2), robot, trial);
        bench.tell(ticks(4), robot, save);
        bench.tell(ticks(5), robot, message(READUID, {robot == 0 ? uint8_t{0} : uint8_t{1}}));
    }
    bench.run(ticks(7));
    CHECK(motors(bench.robot(0)) == Motors{{255, 0}, {65, 0}});
    CHECK(motors(bench.robot(1)) == Motors{{255, 255}, {73, 74}, {0, 0}, {255, 0}, {81, 0}});
}

TEST_CASE("a command that is not known changes nothing") {
    Bench bench({"paused"});
    bench.tell(ticks(1), 0, run_message());
    for (uint8_t type : {0x81, 0x82, 0x8B, 0xFF}) bench.tell(ticks(2) + type, 0, message(type));
    bench.run(ticks(12));
    CHECK(motors(bench.robot(0)) == Motors{{70, 70}});
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0", "setup at 1", "loop 10 at 10"});
}

TEST_CASE("a sleeping robot is dark and deaf but for a look round each 8.2 s") {
    Bench bench({"paused"});
    const Cycles asleep = ticks(2), look = asleep + 8192 * CYCLES_PER_MS + 2400;
    bench.tell(ticks(1), 0, run_message());
    bench.tell(asleep, 0, message(SLEEP));
    bench.tell(ticks(60), 0, message(0x40));
    bench.run(look + 1);
    CHECK(bench.said(0) == Texts{"main, life 1, ticks 0", "setup at 1"});
    CHECK(bench.robot(0).color(look - 1) == 0);
    CHECK(bench.robot(0).color(look) == RGB(3, 3, 3));
    bench.tell(look + 2 + FRAME_CYCLES, 0, message(0x41));
    bench.run(look + 3 + FRAME_CYCLES);
    CHECK(bench.said(0).back() == "heard 65 in loop 2");
    const Cycles down = look + 110 * CYCLES_PER_MS;
    CHECK(bench.robot(0).color(down - 1) == RGB(3, 0, 0));
    CHECK(bench.robot(0).color(down) == 0);
    bench.tell(down + FRAME_CYCLES, 0, message(WAKEUP));
    bench.tell(down + 8192 * CYCLES_PER_MS + FRAME_CYCLES, 0, message(WAKEUP));
    bench.run(down + 8192 * CYCLES_PER_MS + FRAME_CYCLES);
    CHECK(bench.robot(0).color(down + 8192 * CYCLES_PER_MS) == 0);
    bench.run(down + 8192 * CYCLES_PER_MS + FRAME_CYCLES + 1);
    CHECK(bench.robot(0).color(down + 8192 * CYCLES_PER_MS + FRAME_CYCLES + 1) == RGB(0, 3, 0));
    bench.tell(down + ticks(400), 0, run_message());
    bench.run(down + ticks(420));
    CHECK(bench.said(0).back().starts_with("loop"));
}

TEST_CASE("a robot knows its uid and calibration from its EEPROM") {
    Scene scene(square_hall(8));
    scene.add("puppet", {{{0, 0}, 0}, {{0.5, 0}, 0}});
    scene.tell(1, 1, message(SEND, {9}));
    scene.tell(1, 0, message(SAY, {1}));
    Simulation simulation(scene.def);
    simulation.advance(40);
    auto heard = texts(simulation.take_events(), 0);
    REQUIRE(heard.size() >= 2);
    CHECK(heard[0] == "9: 2 0, 500 mm");
}

}  // namespace test_commands
