// The mock keeps the hardware's time: ticks, message periods, delay() anywhere.
#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_time {

namespace {

using Texts = std::vector<std::string>;

constexpr Cycles MS = 8000;
constexpr Cycles BEGIN = 3 * TICK_CYCLES + 1234;  // when RUN comes

std::vector<Cycles> times(const std::vector<Emission> &emissions) {
    std::vector<Cycles> out;
    for (const auto &emission : emissions) out.push_back(emission.at);
    return out;
}

message_t number(uint8_t type, uint16_t value) {
    return message(type, {static_cast<uint8_t>(value), static_cast<uint8_t>(value >> 8)});
}

uint32_t ticks_told(const Emission &emission) {
    const uint8_t *d = emission.message.data + 2;
    return static_cast<uint32_t>(d[0] | d[1] << 8 | d[2] << 16) | static_cast<uint32_t>(d[3]) << 24;
}

/// A sender that runs from the beginning and is told something at times of its own.
std::vector<Emission> sent(Cycles until,
                           const std::vector<std::pair<Cycles, message_t>> &told = {}) {
    Bench bench({"sender"});
    bench.tell(BEGIN, 0, run_message());
    for (const auto &[at, what] : told) bench.tell(at, 0, what);
    bench.run(until);
    return bench.sent(0);
}

}  // namespace

TEST_CASE("a tick is 262,144 cycles of 125 ns") {
    CHECK(TICK_CYCLES == 262'144);
    CHECK(TICK_S == 0.032768);
}

TEST_CASE("delay() suspends anywhere and takes its time, however the robot's time is cut") {
    for (Cycles slice : {Cycles(1000), ticks(1), ticks(2) + 77, ticks(1000)}) {
        CAPTURE(slice);
        Bench bench({"timing", "timing"});
        bench.tell(BEGIN, 0, run_message());
        bench.tell(BEGIN + 20 * MS, 1, run_message());
        bench.run(BEGIN + 2000 * MS, slice);
        for (uint32_t robot : {0u, 1u}) {
            Cycles begin = BEGIN + robot * 20 * MS;
            auto prints = bench.prints(robot);
            REQUIRE(prints.size() > 10);
            // Eleven frames deep; every local variable is as it was: the sum of depth * 4 + i.
            CHECK(prints[0].text == "deep 946");
            CHECK(prints[0].at == begin + 550 * MS);
            CHECK(prints[1].text == "spun up");
            CHECK(prints[1].at == begin + 565 * MS);
            CHECK(prints[2].text == "drawn");
            CHECK(prints[2].at == begin + 565 * MS + MS / 2);
            // loop() gave time back, so it is called again at once.
            for (size_t i = 3; i < prints.size(); i++) {
                CHECK(prints[i].at == prints[i - 1].at + 100 * MS);
                CHECK(prints[i].text == std::to_string(prints[i].at / TICK_CYCLES));
                CHECK(prints[i].tick == prints[i].at / TICK_CYCLES);
            }
        }
    }
}

TEST_CASE("by default a message goes out every 16 ticks") {
    CHECK(times(sent(ticks(70))) ==
          std::vector<Cycles>{ticks(16), ticks(32), ticks(48), ticks(64)});
}

TEST_CASE("kilo_tx_period changes the period from the next tick on") {
    auto four = sent(ticks(30), {{ticks(17), number(0x30, 1000)}});
    CHECK(times(four) == std::vector<Cycles>{ticks(16), ticks(20), ticks(24), ticks(28)});
    auto every = sent(ticks(21), {{ticks(17), number(0x30, 0)}});
    CHECK(times(every) == std::vector<Cycles>{ticks(16), ticks(18), ticks(19), ticks(20)});
    // A tick adds 255 units of 128 us, and a message is due when the sum is above the period.
    auto edge = sent(ticks(15), {{0, number(0x30, 0)},
                                 {ticks(6) + 5, number(0x30, 255)},
                                 {ticks(12) + 5, number(0x30, 254)}});
    CHECK(times(edge) == std::vector<Cycles>{ticks(4), ticks(5), ticks(6), ticks(8), ticks(10),
                                             ticks(12), ticks(13), ticks(14)});
}

TEST_CASE("a program that returns NULL is called again at every tick") {
    auto after = sent(ticks(50), {{ticks(1), number(0x31, 1)}, {ticks(30) + 5, number(0x31, 0)}});
    CHECK(times(after) == std::vector<Cycles>{ticks(31), ticks(47)});
    CHECK(after[0].message.data[0] == 16);  // asked at ticks 16 to 31
    CHECK(after[1].message.data[0] == 17);
}

TEST_CASE("tx_success comes after each message, before the next is asked for") {
    auto all = sent(ticks(70));
    REQUIRE(all.size() == 4);
    for (uint8_t i = 0; i < 4; i++) {
        CHECK(all[i].message.data[0] == i + 1);
        CHECK(all[i].message.data[1] == i);
    }
}

TEST_CASE("nothing is sent before RUN, nor while paused") {
    Bench bench({"sender"});
    bench.run(ticks(40));
    CHECK(bench.sent(0).empty());
    bench.tell(ticks(40) + 1, 0, run_message());
    bench.tell(ticks(45), 0, message(WAKEUP));
    bench.tell(ticks(89) + 1, 0, run_message());
    bench.run(ticks(100));
    CHECK(times(bench.sent(0)) == std::vector<Cycles>{ticks(41), ticks(90)});
}

TEST_CASE("nothing is asked of a program before its setup() goes on from a wait") {
    Bench bench({"slow_start"});
    const Cycles run_at = ticks(30) + 7;  // its transmit clock is over by then
    bench.tell(run_at, 0, run_message());
    bench.run(ticks(32));
    CHECK(bench.robot(0).next_ask() == run_at + 300 * MS);
    bench.run(ticks(45));
    const Cycles first = (run_at + 315 * MS) / TICK_CYCLES + 1;
    CHECK(bench.said(0) == Texts{"asked at " + std::to_string(first)});
    CHECK(times(bench.sent(0)) == std::vector<Cycles>{ticks(first)});
}

TEST_CASE("one of the ticks that come while interrupts are off is counted later") {
    for (const int64_t chunk : {1, 18}) {  // run tick by tick, or at once
        Bench bench({"deaf"});
        bench.tell(ticks(2) + 10, 0, run_message());
        for (int64_t tick = chunk; tick <= 18; tick += chunk) bench.run(ticks(tick));
        // loop() is called at each tick all the same; off in the 5th call, on in the 9th, and then
        // at once again: a tick has come.
        CHECK(bench.said(0) == std::vector<std::string>{"1 at 2", "2 at 3", "3 at 4", "4 at 5",
                                                        "5 at 6", "6 at 6", "7 at 6", "8 at 6",
                                                        "9 at 7", "10 at 7", "11 at 8", "12 at 9"});
        const auto prints = bench.prints(0);
        REQUIRE(prints.size() == 12);
        for (size_t i = 1; i < prints.size(); i++)
            CHECK(prints[i].at == ticks(static_cast<int64_t>(i < 9 ? 2 + i : 1 + i)));
    }
}

TEST_CASE("kilo_ticks counts from kilo_init, and a program may set it") {
    auto plain = sent(ticks(40));
    REQUIRE(plain.size() == 2);
    CHECK(ticks_told(plain[0]) == 16);
    CHECK(ticks_told(plain[1]) == 32);
    auto set = sent(ticks(40), {{ticks(20), number(0x32, 1000)}});
    REQUIRE(set.size() == 2);
    CHECK(set[1].at == ticks(32));
    CHECK(ticks_told(set[1]) == 1012);
}

TEST_CASE("delay() in a receive callback blocks ticks, loop and reception") {
    Bench bench({"callbacks"});
    bench.tell(BEGIN, 0, run_message());
    Cycles heard = ticks(10) + TICK_CYCLES / 2;  // 100 ms are 3.05 ticks
    bench.tell(heard, 0, message(5, {1}));
    bench.tell(heard + 10 * MS, 0, message(5, {2}));  // lost
    bench.tell(heard + 99 * MS, 0, message(5, {3}));  // lost
    bench.tell(heard + 120 * MS, 0, message(5, {4}));
    bench.run(ticks(20));
    auto prints = bench.prints(0);
    std::vector<Event> answers;
    for (const auto &print : prints)
        if (print.text.starts_with("heard")) answers.push_back(print);
    REQUIRE(answers.size() == 2);
    CHECK(answers[0].at == heard + 100 * MS);
    CHECK(answers[0].text == "heard 1, still 1, at 10");
    CHECK(answers[1].at == heard + 220 * MS);
    for (const auto &print : prints)
        if (print.text.starts_with("tick")) {
            CHECK_FALSE((print.at > heard && print.at < heard + 100 * MS));
            CHECK_FALSE((print.at > heard + 120 * MS && print.at < heard + 220 * MS));
        }
    // Ticks 11, 12 and 13 fell into the first one: one stayed pending, two are lost.
    Texts ticks_printed;
    for (const auto &print : prints)
        if (print.text.starts_with("tick") && print.at >= heard && print.at < heard + 120 * MS)
            ticks_printed.push_back(print.text);
    CHECK(ticks_printed == Texts{"tick 11", "tick 12"});
}

TEST_CASE("a callback's message survives its delay(): there is one receive buffer, and it is the "
          "callback's") {
    Bench bench({"callbacks"});
    bench.tell(10, 0, run_message());
    bench.tell(ticks(2), 0, message(5, {77}));
    bench.tell(ticks(2) + 50 * MS, 0, message(5, {78}));
    bench.run(ticks(10), ticks(1));
    bool found = false;
    for (const auto &text : bench.said(0)) found |= text == "heard 77, still 77, at 2";
    CHECK(found);
}

TEST_CASE("delay() in a transmit callback blocks ticks too") {
    Bench bench({"callbacks", "callbacks"});
    bench.tell(BEGIN, 1, run_message());
    bench.run(ticks(40), ticks(1));
    std::vector<Cycles> asked;
    for (const auto &print : bench.prints(1))
        if (print.text.starts_with("asked")) asked.push_back(print.at);
    // 70 ms are 2.1 ticks: of the two ticks that fall into one call, the last is served late, and
    // asks again.
    REQUIRE(asked.size() > 4);
    CHECK(asked[0] == ticks(16) + 70 * MS);
    CHECK(asked[1] == asked[0] + 70 * MS);
    for (const auto &print : bench.prints(1))
        if (print.text.starts_with("asked at")) CHECK(print.tick < print.at / TICK_CYCLES);
}

TEST_CASE("rand_hard gives other bytes to each robot and each draw, the same in each run") {
    Bench a(std::vector<std::string>(10, "roll_call"), 5),
        b(std::vector<std::string>(10, "roll_call"), 5);
    for (uint32_t robot = 0; robot < 10; robot++) {
        a.tell(10, robot, run_message());
        b.tell(10, robot, run_message());
    }
    a.run(ticks(3));
    b.run(ticks(3), 999);
    for (uint32_t robot = 0; robot < 10; robot++) {
        CHECK(a.said(robot) == b.said(robot));
        for (uint32_t other = 0; other < robot; other++) CHECK(a.said(robot) != a.said(other));
    }
}

}  // namespace test_time
