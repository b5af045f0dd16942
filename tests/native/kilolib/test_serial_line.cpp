/// printf() by the serial line.
#include "bench.h"

using namespace kilotwin;

namespace test_serial_line {

namespace {

std::string text_of(const Bench &bench) {
    std::string text;
    for (const auto &byte : bench.board.outputs.serial) text += static_cast<char>(byte.byte);
    return text;
}

}  // namespace

TEST_CASE("printf() waits for the serial line, which takes 0.26 ms a character") {
    Bench bench("printer", 4711);
    bench.run_ms(20);
    bench.hear(make_message(RUN));
    bench.run_ms(30);
    CHECK(text_of(bench) == "uid 4711, 31 ticks a second\n");
    const auto &serial = bench.board.outputs.serial;
    const double per_character =
        double(serial.back().at - serial.front().at) / double(serial.size() - 1) / double(MS);
    CHECK(per_character > 0.24);
    CHECK(per_character < 0.3);
}

TEST_CASE("printf() that does not wait loses what its queue does not hold") {
    Bench bench("printer_nonblocking");
    bench.start();
    bench.run_ms(100);
    const std::string text = text_of(bench);
    CHECK(bench.byte("said") == 1);
    CHECK(text.substr(0, 16) == "line  0\nline  1\n");
    CHECK(text.size() >= 127);
    CHECK(text.size() < 20 * 8);
    bench.run_ms(100);
    CHECK(text_of(bench) == text);
}

}  // namespace test_serial_line
