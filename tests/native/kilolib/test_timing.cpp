/// Ticks and slots to the cycle (hardware.md 1.6).
#include <cstring>

#include "bench.h"

using namespace kilotwin;

namespace test_timing {

namespace {

void talk_for_ever(Bench &bench, const message_t &message) {
    const auto *bytes = reinterpret_cast<const uint8_t *>(&message);
    for (uint16_t i = 0; i < sizeof message; i++)
        bench.board.write(static_cast<uint16_t>(bench.address("outgoing") + i), bytes[i]);
    bench.set("talks", 255, 1);
}

}  // namespace

TEST_CASE("a tick takes 32.768 ms while nothing is sent") {
    Bench bench("probe");
    bench.start();
    const uint32_t before = bench.ticks();
    bench.run_ms(10000);
    CHECK(bench.ticks() - before >= 305);
    CHECK(bench.ticks() - before <= 306);
}

TEST_CASE("a frame has slots of 269 cycles, and another follows each 16 ticks") {
    Bench bench("probe");
    bench.start();
    const message_t message = make_message(5, {0, 255, 1, 128, 0x55, 0xAA, 7, 8, 9});
    talk_for_ever(bench, message);
    bench.run_ms(3000);
    auto frames = frames_of(bench.board.outputs.light);
    REQUIRE(frames.size() >= 5);
    for (size_t i = 1; i < frames.size(); i++) {
        CHECK(frames[i].crc_is_right);
        CHECK(std::memcmp(&frames[i].message, &message, sizeof message) == 0);
        CHECK(frames[i].begin - frames[i - 1].begin >= 16 * TICK_CYCLES - 30);
        CHECK(frames[i].begin - frames[i - 1].begin <= 16 * TICK_CYCLES + 30);
    }
    CHECK(bench.byte("sent") == frames.size());
}

TEST_CASE("a pulse takes nine cycles") {
    Bench bench("probe");
    bench.start();
    talk_for_ever(bench, make_message(5, {1, 2, 3}));
    bench.run_ms(1000);
    const auto &light = bench.board.outputs.light;
    REQUIRE(light.size() > 50);
    for (size_t i = 0; i + 1 < light.size(); i += 2) {
        CHECK(light[i].on);
        CHECK(light[i + 1].at - light[i].at == 9);
    }
}

TEST_CASE("a robot that always finds the channel busy has 58.7 ticks a second and sends nothing") {
    Bench bench("probe");
    bench.start();
    talk_for_ever(bench, make_message(5));
    bench.run_ms(600);
    const uint8_t sent = bench.byte("sent");
    // Light that never goes out: no edges, so the receiver is not occupied, but the leader hears
    // it.
    bench.board.shine({bench.board.now() + 10, bench.board.now() + 60000 * MS, {300, 600}});
    bench.run_ms(1000);
    const uint32_t before = bench.ticks();
    bench.run_ms(10000);
    // A retry comes after 16.4 ms on average, with a deviation of 9.5 ms: 0.9 % for 580 of them.
    const double rate = (bench.ticks() - before) / 10.0;
    CHECK(rate > 57);
    CHECK(rate < 60.5);
    CHECK(bench.byte("sent") == sent);
}

TEST_CASE("a program that has nothing to send is called again at each tick") {
    Bench bench("probe");
    bench.start();
    bench.run_ms(1000);
    const uint8_t asked = bench.byte("asked");
    const uint32_t ticks = bench.ticks();
    bench.run_ms(1000);
    CHECK(uint8_t(bench.byte("asked") - asked) == bench.ticks() - ticks);
}

TEST_CASE("a robot that is not running is not asked for a message") {
    Bench bench("probe");
    bench.set("talks", 255, 1);
    bench.run_ms(1500);
    CHECK(bench.byte("asked") == 0);
    CHECK(bench.board.outputs.light.empty());
}

TEST_CASE("a program may set its ticks and its period") {
    Bench bench("probe");
    bench.start();
    bench.set("kilo_ticks", 1000000, 4);
    bench.set("kilo_tx_period", 250, 2);
    talk_for_ever(bench, make_message(5));
    bench.run_ms(1000);
    CHECK(bench.ticks() >= 1000030);
    CHECK(bench.ticks() <= 1000031);
    CHECK(frames_of(bench.board.outputs.light).size() >= 29);
}

TEST_CASE("delay() waits as long as it is told") {
    Bench bench("probe");
    bench.start();
    bench.set("argument", 100, 2);
    bench.set("request", DELAY, 1);
    const Cycles before = bench.board.now();
    while (bench.byte("request") != 0) bench.run_ms(0.01);
    const double ms = double(bench.board.now() - before) / double(MS);
    CHECK(ms > 100);
    CHECK(ms < 100.3);
}

}  // namespace test_timing
