// Every variable of a program is private to each robot, wherever C lets one hide.
#include <doctest/doctest.h>

#include <cstdio>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_variables {

namespace {

using Texts = std::vector<std::string>;

/// The minimal standard generator of Park and Miller, as avr-libc has it.
uint32_t next(uint32_t &state) {
    return state = static_cast<uint32_t>(state * 16807ull % 2147483647);
}

std::string rand_line(uint32_t seed) {
    std::string line = "rand";
    for (int i = 0; i < 4; i++) line += " " + std::to_string(next(seed) % 32768);
    return line;
}

}  // namespace

TEST_CASE(
    "globals, function statics and statics of one name in several files are each robot's own") {
    Bench bench(std::vector<std::string>(20, "variables"));
    for (uint32_t robot = 0; robot < 20; robot++) bench.tell(10, robot, run_message());
    bench.run(ticks(60), ticks(1));
    for (int uid = 1; uid <= 20; uid++) {
        char expected[100];
        int calls = 100 + 50 * (uid - 1) + 1, other = (-1 - 51 * uid) * 1000 - 51;
        std::snprintf(expected, sizeof expected, "%d %d %d %d %d %d %s", 1000 + 50 * uid, -50 * uid,
                      7 + 50, calls, other, 500 + uid, uid % 2 ? "odd" : "even");
        CHECK(bench.said(static_cast<uint32_t>(uid - 1)) == Texts{expected});
    }
}

TEST_CASE("a second world starts with fresh variables, beside the first one") {
    Bench first({"variables", "variables"});
    first.tell(10, 0, run_message());
    first.run(ticks(30));
    Bench second({"variables", "variables"});
    second.tell(10, 0, run_message());
    second.run(ticks(60));
    first.run(ticks(60));
    REQUIRE(first.said(0).size() == 1);
    CHECK(first.said(0) == second.said(0));
}

TEST_CASE("rand, random and rand_soft are each robot's own and give what they give on the AVR") {
    Bench bench({"random", "random", "random"});
    for (uint32_t robot = 0; robot < 3; robot++) bench.tell(10, robot, run_message());
    bench.run(ticks(2));
    for (uint32_t robot : {0u, 2u}) {
        auto said = bench.said(robot);
        REQUIRE(said.size() > 4);
        CHECK(said[0] == "soft FD 15 B8 7B A7 9A 49 00 02 10 96 25 0E 7E 89 C4");
        CHECK(said[1] == rand_line(1));
        CHECK(said[2] == rand_line(5));
        uint32_t state = 1;
        uint32_t draws[2] = {next(state), next(state)};
        CHECK(said[3] == "random " + std::to_string(draws[0]) + " " + std::to_string(draws[1]) +
                             ", 32767 2147483647");
    }
    auto seeded = bench.said(1);
    REQUIRE(seeded.size() > 2);
    CHECK(seeded[0] == "soft 09 43 59 95 3D D2 41 4A");
    CHECK(seeded[1] == rand_line(42));
}

TEST_CASE("message_crc, estimate_distance and the sensors answer") {
    Bench bench({"random"});
    bench.tell(10, 0, run_message());
    bench.run(ticks(2));
    auto said = bench.said(0);
    REQUIRE(said.size() == 11);
    CHECK(Texts(said.begin() + 4, said.end()) == Texts{"crc 9C87", "crc 8D0E", "crc 840A",
                                                       "crc 94C7", "crc 036D", "distance 33 255",
                                                       "sensors 1 1 1"});
}

TEST_CASE("malloc's heap is each robot's own, runs out, and freed blocks join") {
    Bench bench({"memory", "memory", "memory"});
    for (uint32_t robot = 0; robot < 3; robot++) bench.tell(10, robot, run_message());
    bench.run(ticks(64), ticks(1));
    for (uint32_t robot = 0; robot < 3; robot++) {
        CHECK(bench.others(robot).empty());
        CHECK(bench.said(robot) == Texts{"pieces 128", "spoilt 0", "hole 0", "joined 1",
                                         "calloc 0, 0", "realloc kept, 0", "aligned 0",
                                         "too much 0 0", "nothing 1"});
    }
}

TEST_CASE("an event of printf has robot, text and time") {
    Bench bench({"roll_call", "roll_call"});
    bench.tell(ticks(5) + 100, 1, run_message());
    bench.run(ticks(10));
    CHECK(bench.said(0).empty());
    auto printed = bench.prints(1);
    REQUIRE(printed.size() == 1);
    CHECK(printed[0].robot == 1);
    CHECK(printed[0].program == "roll_call");
    CHECK(printed[0].tick == 5);
    CHECK(printed[0].at ==
          ticks(5) + 100 + 4 * CYCLES_PER_SECOND / 2000);  // four rand_hard of 0.5 ms
}

}  // namespace test_variables
