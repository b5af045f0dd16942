// Printing takes the time of the serial line, and the robot is busy meanwhile. `printer` prints in
// a way of its own for each uid.
#include <doctest/doctest.h>

#include "robots/native/serial_line.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_printing {

namespace {

constexpr Cycles BYTE = SERIAL_BYTE_CYCLES;
constexpr Cycles BEGIN = ticks(2) + 10;  // RUN

/// One robot for each way to print; `way` alone runs.
struct Printing : Bench {
    explicit Printing(uint32_t way)
        : Bench(std::vector<std::string>(way, "printer")),
          robot(way - 1) {
        tell(BEGIN, robot, run_message());
    }
    std::vector<Cycles> times() const {
        std::vector<Cycles> out;
        for (const auto &print : prints(robot)) out.push_back(print.at);
        return out;
    }
    uint32_t robot;
};

}  // namespace

TEST_CASE("a byte takes the serial line 260 us, and the chip holds one") {
    SerialLine line;
    CHECK(BYTE == 2080);
    CHECK(line.ready(100) == 100);
    CHECK(line.write(100, 1) == 100);
    CHECK(line.ready(150) == 100 + BYTE);
    CHECK(line.write(150, 3) == 100 + 3 * BYTE);
    CHECK(line.ready(100 + 4 * BYTE) == 100 + 4 * BYTE);
    CHECK(line.write(10'000, 2) == 10'000 + BYTE);
}

TEST_CASE("a queue holds 127 bytes beside the one that is sent, and loses the others") {
    SerialLine line;
    CHECK(line.queue(100, 100) == 100);
    CHECK(line.queue(100, 100) == 28);
    CHECK(line.queue(100, 1) == 0);
    CHECK(line.queue(99 + BYTE, 1) == 0);
    CHECK(line.queue(100 + BYTE, 5) == 1);
    CHECK(line.ready(200) == 100 + 129 * BYTE);
    CHECK(line.queue(100 + 129 * BYTE, 200) == 128);
}

TEST_CASE("printf() keeps the robot busy until the line has taken its text, however the robot's "
          "time is cut") {
    for (Cycles slice : {ticks(1000), ticks(1), Cycles(1000), ticks(2) + 77}) {
        CAPTURE(slice);
        Printing bench(1);
        bench.tell(ticks(10) + 5, bench.robot, message(5));
        bench.run(ticks(40), slice);
        const auto prints = bench.prints(bench.robot);
        REQUIRE(prints.size() > 470);
        CHECK(prints.back().at + 10 * BYTE >= ticks(40));
        for (size_t i = 0; i < prints.size(); i++) {
            // It is reported when its last byte goes out; loop() comes again at once.
            CHECK(prints[i].at == BEGIN + (10 * i + 9) * BYTE);
            CHECK(prints[i].tick == prints[i].at / TICK_CYCLES);
            // What the callback counted between is seen by the next print.
            const bool heard = BEGIN + 10 * i * BYTE > ticks(10) + 5 + BYTE;
            CHECK(prints[i].text == (heard ? "  1 heard\n" : "  0 heard\n"));
        }
        // Ticks pass: it is asked for a message as ever.
        REQUIRE(bench.sent(bench.robot).size() == 2);
        CHECK(bench.sent(bench.robot)[0].at == ticks(16));
        CHECK(bench.sent(bench.robot)[1].at == ticks(32));
        CHECK(bench.others(bench.robot).empty());
    }
}

TEST_CASE("printf() with NONBLOCKING takes no time, and loses what its queue does not hold") {
    Printing bench(2);
    bench.run(ticks(5) - 1);
    // At each tick there is room for 262,144 / 2,080 = 126 bytes.
    std::string text;
    for (const auto &said : bench.said(bench.robot)) text += said;
    const auto times = bench.times();
    REQUIRE(times.size() > 20);
    CHECK(times[0] == BEGIN);
    CHECK(times[12] == BEGIN);
    CHECK(bench.said(bench.robot)[12] == "  0 hear");  // the last of 128 bytes
    CHECK(times[13] == ticks(3));
    CHECK(text.size() == 128 + (ticks(3) - BEGIN) / BYTE + (ticks(4) - ticks(3)) / BYTE);
}

TEST_CASE("bytes written to UDR0 take their time where the program polls for the line") {
    for (Cycles slice : {ticks(64), Cycles(1000)}) {
        CAPTURE(slice);
        Printing bench(3);
        bench.run(ticks(3) - 1, slice);
        const auto prints = bench.prints(bench.robot);
        REQUIRE(prints.size() == (ticks(3) - 1 - BEGIN) / (11 * BYTE));
        for (size_t i = 0; i < prints.size(); i++) {
            CHECK(prints[i].text == "0123456789\n");
            CHECK(prints[i].at == BEGIN + (11 * i + 10) * BYTE);
        }
    }
}

TEST_CASE("a callback that prints receives nothing meanwhile") {
    Printing bench(4);
    const Cycles first = ticks(4) + 5;
    bench.tell(first, bench.robot, message(5));
    bench.tell(first + 38 * BYTE, bench.robot, message(5));
    bench.tell(first + 50 * BYTE, bench.robot, message(5));
    bench.run(ticks(8));
    CHECK(bench.times() == std::vector<Cycles>{first + 39 * BYTE, first + 89 * BYTE});
}

TEST_CASE("a program that never called debug_init() prints without taking time") {
    Printing bench(5);
    bench.run(ticks(3) - 1);
    CHECK(bench.times() == std::vector<Cycles>(20, BEGIN));
}

}  // namespace test_printing
