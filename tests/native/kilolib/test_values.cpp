/// Functions of the API whose results are known numbers.
#include <set>

#include "bench.h"

using namespace kilotwin;

namespace test_values {

TEST_CASE("rand_soft() gives the known numbers from power-up and after a seed") {
    Bench bench("probe");
    bench.start();
    for (int expected : {0xFD, 0x15, 0xB8, 0x7B, 0xA7, 0x9A, 0x49, 0x00, 0x02, 0x10, 0x96, 0x25,
                         0x0E, 0x7E, 0x89, 0xC4})
        CHECK(bench.ask(RAND_SOFT) == expected);
    Bench seeded("probe");
    seeded.start();
    seeded.ask(RAND_SEED, 1);
    for (int expected : {0x09, 0x43, 0x59, 0x95, 0x3D, 0xD2, 0x41, 0x4A})
        CHECK(seeded.ask(RAND_SOFT) == expected);
}

TEST_CASE("rand_hard() lives on the converter's noise and takes about half a millisecond") {
    Bench bench("probe");
    bench.start();
    std::set<int> seen;
    Cycles spent = 0;
    for (int i = 0; i < 200; i++) {
        bench.set("request", RAND_HARD, 1);
        const Cycles before = bench.board.now();
        while (bench.byte("request") != 0) bench.board.run(bench.board.now() + 100);
        spent += bench.board.now() - before;
        seen.insert(static_cast<int>(bench.word("result", 2)));
    }
    // Of 256 values, 200 draws find 139 on average, with a deviation of 5.
    CHECK(seen.size() > 115);
    CHECK(seen.size() < 165);
    const double ms = double(spent) / 200 / double(MS);
    CHECK(ms > 0.2);
    CHECK(ms < 1);
}

TEST_CASE("the crc has its known values") {
    Bench bench("probe");
    bench.start();
    struct {
        message_t message;
        uint16_t crc;
    } const known[] = {{make_message(0), 0x9C87},
                       {make_message(1), 0x8D0E},
                       {make_message(2, {1, 2, 3, 4, 5, 6, 7, 8, 9}), 0x840A},
                       {make_message(0x88), 0x94C7},
                       {make_message(0x7F, std::vector<uint8_t>(9, 0xFF)), 0x036D}};
    for (const auto &[message, crc] : known) {
        const auto *bytes = reinterpret_cast<const uint8_t *>(&message);
        for (uint16_t i = 0; i < sizeof message; i++)
            bench.board.write(static_cast<uint16_t>(bench.address("outgoing") + i), bytes[i]);
        CHECK(static_cast<uint16_t>(bench.ask(CRC)) == crc);
        CHECK(message.crc == crc);
    }
}

TEST_CASE("estimate_distance() agrees with the emulator's own") {
    Bench bench("probe");
    bench.start();
    for (double mm = 30; mm < 115; mm += 0.7) {
        const auto gains = bench.calibration.gains.measure(mm);
        bench.set("gains", static_cast<uint16_t>(gains.low_gain), 2);
        bench.set("gains",
                  static_cast<uint16_t>(gains.low_gain) | static_cast<uint32_t>(gains.high_gain)
                                                              << 16,
                  4);
        CHECK(bench.ask(DISTANCE) == bench.calibration.gains.estimate_mm(gains));
    }
}

}  // namespace test_values
