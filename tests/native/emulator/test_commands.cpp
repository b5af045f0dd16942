// System messages: RUN, the pause that WAKEUP is, RESET, SLEEP.
#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace {

using Texts = std::vector<std::string>;
using Motors = std::vector<std::pair<int, int>>;

Motors motors(Robot &robot) {
    Motors out;
    for (const auto &command : robot.motor_commands) out.emplace_back(command.left, command.right);
    robot.motor_commands.clear();
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
    auto commands = bench.robot(0).motor_commands;
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
