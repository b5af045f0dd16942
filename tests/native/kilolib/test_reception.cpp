/// Reception of infrared light, and the converter's readings of it (hardware.md 1.6, 1.8).
#include <cstring>

#include "bench.h"

using namespace kilotwin;

namespace test_reception {

namespace {

constexpr distance_measurement_t DIM = {1, 1};

uint32_t received(const Bench &bench) { return bench.word("received_count", 2); }

void check_last(const Bench &bench, const message_t &message) {
    const uint16_t at = bench.address("last_message");
    const auto *bytes = reinterpret_cast<const uint8_t *>(&message);
    for (uint16_t i = 0; i < sizeof message; i++)
        CHECK(bench.board.read(static_cast<uint16_t>(at + i)) == bytes[i]);
}

}  // namespace

TEST_CASE("a message reaches the callback, high gain at the leader's start and low at its stop") {
    Bench bench("probe");
    bench.start();
    const message_t message = make_message(0x7F, {1, 2, 3, 4, 255, 0, 128, 8, 9});
    const Cycles begin = bench.board.now() + 100, stop = begin + 9 * SLOT;
    bench.shine_frame(begin, message, DIM);
    bench.board.shine({begin, begin + 40, {0, 599}});
    bench.board.shine({stop, stop + 40, {299, 0}});
    bench.run_ms(5);
    CHECK(received(bench) == 1);
    check_last(bench, message);
    CHECK(bench.low_gain() == 300);
    CHECK(bench.high_gain() == 600);
}

TEST_CASE("messages are received before the program runs, and while it is paused") {
    Bench bench("probe");
    bench.run_ms(20);
    bench.hear(make_message(NORMAL, {1}));
    CHECK(received(bench) == 1);
    CHECK(bench.byte("setups") == 0);
    bench.start();
    bench.hear(make_message(WAKEUP));
    bench.hear(make_message(NORMAL, {2}));
    CHECK(received(bench) == 2);
}

TEST_CASE("frames that follow each other closely are all received, whatever the ticks do") {
    Bench bench("probe");
    bench.start();
    for (uint8_t i = 0; i < 200; i++) {
        // At odd distances, so that ticks fall into frames everywhere.
        bench.shine_frame(bench.board.now() + 50 + 13u * (i % 50), make_message(2, {i, 0xFF, 0xFF}),
                          DIM);
        bench.board.run(bench.board.now() + 36500);
        CHECK(received(bench) == i + 1u);
    }
}

TEST_CASE("a sender's clock may be off by 4 per cent") {
    // In a run of ones an edge follows the other slot by slot.
    const std::vector<uint8_t> ones(9, 0xFF);
    for (Cycles slot : {SLOT - 11, SLOT + 11}) {
        for (const auto &data : {std::vector<uint8_t>{0xA5, 0xFF, 0, 1}, ones}) {
            Bench bench("probe");
            bench.start();
            bench.shine_frame(bench.board.now() + 100, make_message(0x7F, data), DIM, slot);
            bench.run_ms(6);
            CHECK(received(bench) == 1);
        }
    }
}

TEST_CASE("a frame with a wrong crc is dropped, and the next one is not") {
    Bench bench("probe");
    bench.start();
    message_t wrong = make_message(1, {1, 2});
    wrong.crc ^= 0x0100;
    bench.hear(wrong);
    CHECK(received(bench) == 0);
    bench.hear(make_message(1, {1, 2}));
    CHECK(received(bench) == 1);
}

TEST_CASE("a frame that breaks off, or a flash, is forgotten after eleven slots") {
    Bench bench("probe");
    bench.start();
    const Cycles at = bench.board.now() + 100;
    bench.board.shine({at, at + 40, DIM});
    bench.board.run(at + 10 * SLOT);
    CHECK(bench.byte("reader") == 1);
    bench.board.run(at + 12 * SLOT);
    CHECK(bench.byte("reader") == 0);
    bench.hear(make_message(1));
    CHECK(received(bench) == 1);
}

TEST_CASE("two frames at the same time are a collision") {
    Bench bench("probe");
    bench.start();
    const Cycles at = bench.board.now() + 100;
    bench.shine_frame(at, make_message(1, {1, 2, 3}), DIM);
    bench.shine_frame(at + 4 * SLOT + 60, make_message(2, {4, 5, 6}), DIM);
    bench.run_ms(8);
    CHECK(received(bench) == 0);
    bench.hear(make_message(1));
    CHECK(received(bench) == 1);
}

TEST_CASE("a robot that receives sends nothing, and is asked again at the next tick") {
    Bench bench("probe");
    bench.start();
    bench.set("kilo_tx_period", 1, 2);
    bench.set("talks", 255, 1);
    while (bench.board.outputs.light.empty()) bench.run_ms(1);
    bench.run_ms(6);
    for (int i = 0; i < 30; i++) {
        const auto sent = frames_of(bench.board.outputs.light);
        REQUIRE(!sent.empty());
        const Cycles tick = sent.back().begin + TICK_CYCLES;
        bench.board.outputs.clear();
        const Cycles begin = tick - 3 * MS + static_cast<Cycles>(i) * 600;
        bench.shine_frame(begin, make_message(1, {1, 2, 3}), DIM);
        bench.board.run(begin + 6 * MS);
        CHECK(bench.board.outputs.light.empty());
        CHECK(received(bench) == i + 1u);
        bench.board.run(tick + TICK_CYCLES + 10 * MS);
    }
}

TEST_CASE("a robot that hears another in its leader gives up, and tries again soon") {
    Bench bench("probe");
    bench.start();
    bench.set("talks", 1, 1);
    while (bench.ticks() < 15) bench.run_ms(1);
    REQUIRE(bench.board.outputs.light.empty());
    // Light that begins before the attempt and ends after it, and no frame.
    bench.board.shine({bench.board.now() + 100, bench.board.now() + 45 * MS, DIM});
    bench.run_ms(45);
    const size_t pulses = bench.board.outputs.light.size() / 2;
    CHECK(pulses >= 1);
    CHECK(pulses <= 20);  // leaders only
    CHECK(bench.byte("sent") == 0);
    bench.run_ms(40);
    CHECK(bench.byte("sent") == 1);
}

TEST_CASE("sensors read their channels, and -1 while a frame comes in") {
    Bench bench("probe");
    bench.start();
    bench.board.readings[SENSOR_LIGHT] = 400;
    bench.board.readings[SENSOR_BATTERY] = 700;
    bench.board.readings[SENSOR_TEMPERATURE] = 290;
    CHECK(std::abs(bench.ask(LIGHT) - 400) <= 1);
    CHECK(std::abs(bench.ask(VOLTAGE_READING) - 700) <= 1);
    CHECK(std::abs(bench.ask(TEMPERATURE) - 290) <= 1);
    for (Request sensor : {LIGHT, VOLTAGE_READING, TEMPERATURE}) {
        bench.shine_frame(bench.board.now() + 100, make_message(1, {1}), DIM);
        bench.run_ms(1);
        CHECK(bench.ask(sensor) == -1);
        bench.run_ms(5);
    }
    CHECK(received(bench) == 3);
}

TEST_CASE("a sensor that is read leaves the gains of the next message as they are") {
    Bench bench("probe");
    bench.start();
    for (Request sensor : {LIGHT, VOLTAGE_READING, TEMPERATURE, RAND_HARD}) {
        bench.ask(sensor);
        bench.hear(make_message(1), {123, 456});
        CHECK(bench.low_gain() == 123);
        CHECK(bench.high_gain() == 456);
    }
    CHECK(received(bench) == 4);
}

TEST_CASE("a program that reads a sensor all the time still receives, and knows the distances") {
    Bench bench("probe");
    bench.start();
    const uint8_t expected = bench.calibration.gains.estimate_mm({300, 1023});
    int by_low_gain = 0;
    for (int i = 0; i < 50; i++) {
        bench.shine_frame(bench.board.now() + 100 + static_cast<Cycles>(i) * 7, make_message(1),
                          {300, 500});
        for (int asked = 0; asked < 60; asked++) {
            bench.set("request", LIGHT, 1);
            bench.run_ms(0.1);
        }
        CHECK(received(bench) == i + 1u);
        CHECK(bench.low_gain() == 300);
        const bool unknown = bench.high_gain() == 1023;
        CHECK((unknown || bench.high_gain() == 500));
        by_low_gain += unknown;
    }
    CHECK(by_low_gain > 0);
    CHECK(by_low_gain < 50);
    bench.set("gains", 300 | 1023u << 16, 4);
    CHECK(bench.ask(DISTANCE) == expected);
}

}  // namespace test_reception
