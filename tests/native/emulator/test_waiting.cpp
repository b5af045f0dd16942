// Programs that wait or compute without coming back. `waiting` does it in a way of its own for each
// uid.
#include <doctest/doctest.h>

#include <tuple>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_waiting {

namespace {

using Texts = std::vector<std::string>;

/// One robot for each way to wait; `way` alone runs.
struct Waiting : Bench {
    explicit Waiting(uint32_t way)
        : Bench(std::vector<std::string>(way, "waiting")),
          robot(way - 1) {
        tell(ticks(2) + 10, robot, run_message());
    }
    uint32_t robot;
};

/// Words of robots that run `phases`, whether waits of theirs are looked for early or late.
struct Told {
    std::vector<std::tuple<Cycles, uint32_t, std::string>> prints;
    std::vector<std::vector<std::tuple<Cycles, uint8_t, uint8_t>>> motors;
    std::vector<std::vector<uint8_t>> states;
};

Told told_with(bool looks_early) {
    constexpr uint32_t ROBOTS = 20;
    Program &program = Program::load(guest("phases"), "phases");
    program.looks_early = looks_early;
    program.turns_to_look = TURNS_PER_TICK;
    Bench bench(std::vector<std::string>(ROBOTS, "phases"));
    for (uint32_t robot = 0; robot < ROBOTS; robot++) {
        bench.tell(ticks(2) + 10, robot, run_message());
        for (uint64_t tick = 9; tick < 90; tick += 7 + robot % 3)
            bench.tell(ticks(tick) + 1000 * robot, robot, message(5));
    }
    bench.run(ticks(100));
    Told told;
    for (const auto &event : bench.events)
        told.prints.emplace_back(event.at, event.robot, event.text);
    for (uint32_t robot = 0; robot < ROBOTS; robot++) {
        auto &of = told.motors.emplace_back();
        for (const auto &command : bench.robot(robot).motor_commands())
            of.emplace_back(command.at, command.left, command.right);
        told.states.push_back(bench.robot(robot).variables());
    }
    program.looks_early = true;
    CHECK((program.turns_to_look < TURNS_PER_TICK) == looks_early);
    return told;
}

}  // namespace

TEST_CASE("a wait is found in the same turn, looked for early or late") {
    const Told early = told_with(true), late = told_with(false);
    CHECK(early.prints.size() > 300);
    CHECK(early.prints == late.prints);
    CHECK(early.motors == late.motors);
    CHECK(early.states == late.states);
}

TEST_CASE("a busy-wait on kilo_ticks advances") {
    Waiting bench(1);
    bench.run(ticks(150));
    CHECK(bench.said(bench.robot) == Texts{"waited 100 until 102"});
    CHECK(bench.others(bench.robot).empty());
}

TEST_CASE("a busy-wait on a flag that a callback sets advances within a tick") {
    Waiting bench(2);
    bench.tell(ticks(40) + 99, bench.robot, message(5));
    bench.run(ticks(43));
    auto prints = bench.prints(bench.robot);
    REQUIRE(prints.size() == 1);
    CHECK(prints[0].at >= ticks(40) + 99);
    CHECK(prints[0].at <= ticks(42));
}

TEST_CASE("a busy-wait with calls of the API in it advances") {
    Waiting bench(8);
    bench.tell(ticks(40), bench.robot, message(5));
    bench.run(ticks(43));
    CHECK(bench.prints(bench.robot).size() >= 1);
    CHECK(shown(bench.Bench::robot(bench.robot)) == RGB(1, 0, 0));
}

TEST_CASE("a wait of more than 10 s is warned about once, and goes on") {
    Waiting bench(2);
    bench.run(ticks(2000));
    auto others = bench.others(bench.robot);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::BUSY_WAIT);
    CHECK(others[0].robot == bench.robot);
    CHECK(others[0].program == "waiting");
    CHECK(others[0].tick == 2 + 305 + 1);  // 10 s are 305.2 ticks
    bench.tell(ticks(2000) + 1, bench.robot, message(5));
    bench.run(ticks(2003));
    CHECK(bench.said(bench.robot).size() == 1);
}

TEST_CASE("for (;;); stays where it is, warned about, with interrupts served") {
    Waiting bench(3);
    bench.tell(ticks(5), bench.robot, message(5));
    bench.tell(ticks(500), bench.robot, message(5));
    bench.tell(ticks(3000), bench.robot, message(5));
    bench.run(ticks(4000));
    CHECK(bench.said(bench.robot) == Texts{"heard 1", "heard 2", "heard 3"});
    auto others = bench.others(bench.robot);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::BUSY_WAIT);
    CHECK_FALSE(bench.Bench::robot(bench.robot).stopped());
}

TEST_CASE("delay(0) for ever is a loop in which time passes, and is warned about") {
    Waiting bench(12);
    bench.tell(ticks(5), bench.robot, message(5));
    bench.run(ticks(4000));
    CHECK_FALSE(bench.Bench::robot(bench.robot).stopped());
    auto others = bench.others(bench.robot);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::BUSY_WAIT);
}

TEST_CASE("a loop that nothing counts is stopped after 5 s of CPU time, and named") {
    Waiting bench(13);
    bench.tell(ticks(5), 0, run_message());
    bench.run(ticks(200));
    CHECK(bench.Bench::robot(bench.robot).stopped());
    auto others = bench.others(bench.robot);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::ENDLESS);
    CHECK(others[0].text.starts_with("it computed for 5 s of CPU time"));
    CHECK(others[0].tick == 2);
    CHECK(bench.said(0) == Texts{"waited 100 until 105"});
}

TEST_CASE("endless computing is stopped after 60 s") {
    for (uint32_t way : {4u, 5u}) {
        CAPTURE(way);
        Waiting bench(way);
        bench.run(ticks(1825));
        CHECK_FALSE(bench.Bench::robot(bench.robot).stopped());
        bench.run(ticks(1900));
        CHECK(bench.Bench::robot(bench.robot).stopped());
        auto others = bench.others(bench.robot);
        REQUIRE(others.size() == 2);
        CHECK(others[0].kind == EventKind::BUSY_WAIT);
        CHECK(others[1].kind == EventKind::ENDLESS);
        CHECK(others[1].program == "waiting");
        CHECK(others[1].robot == bench.robot);
        CHECK(seconds(others[1].at - ticks(2)) >= 60);
        CHECK(seconds(others[1].at - ticks(2)) < 60.2);
    }
}

TEST_CASE("a loop of the program's own that calls the API now and then may go on for ever") {
    Waiting bench(10);
    bench.run(ticks(4000));
    CHECK_FALSE(bench.Bench::robot(bench.robot).stopped());
    auto others = bench.others(bench.robot);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::BUSY_WAIT);
}

TEST_CASE("a long computation takes the time it would, and ends") {
    Waiting bench(6);
    bench.run(ticks(500));
    auto prints = bench.prints(bench.robot);
    REQUIRE(prints.size() >= 2);
    CHECK(bench.others(bench.robot).empty());
    // A million turns of a basic block or less (compilers unroll loops), at ten cycles a block.
    Cycles took = prints[1].at - prints[0].at;
    CHECK(seconds(took) > 0.2);
    CHECK(seconds(took) < 5);
}

TEST_CASE("a wait of 98 s on a copy of kilo_ticks is not taken for computing, whatever callbacks "
          "count meanwhile") {
    Waiting bench(7);
    for (uint64_t i = 3; i < 3050; i++) bench.tell(ticks(i) + 100, bench.robot, message(5));
    bench.run(ticks(3050));
    CHECK(bench.said(bench.robot) == Texts{"waited 3000 until 3002"});
    CHECK_FALSE(bench.Bench::robot(bench.robot).stopped());
}

TEST_CASE(
    "a callback that waits for kilo_ticks waits for ever, as on hardware, and is warned about") {
    Waiting bench(9);
    bench.tell(ticks(50), bench.robot, message(5));
    bench.run(ticks(500));
    auto others = bench.others(bench.robot);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::BUSY_WAIT);
    CHECK(others[0].tick == 50);
}

TEST_CASE("a program that comes back in time is never warned about") {
    Bench bench(std::vector<std::string>(11, "waiting"));
    bench.tell(10, 10, run_message());
    bench.run(ticks(5000));
    CHECK(bench.others(10).empty());
}

}  // namespace test_waiting
