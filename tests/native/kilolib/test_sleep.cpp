/// SLEEP and waking up (hardware.md 1.3).
#include "bench.h"

using namespace kilotwin;

namespace test_sleep {

namespace {

constexpr uint8_t WHITE = 0x3F, RED = 0x03;

/// Repeats a frame, as an overhead controller does, for so long.
void repeat(Bench &bench, const message_t &message, double ms) {
    const Cycles end = bench.board.now() + static_cast<Cycles>(ms * double(MS));
    while (bench.board.now() < end) {
        bench.shine_frame(bench.board.now() + 100, message, {300, 600});
        bench.run_ms(10.4);
    }
}

/// For a while, that is: one port is written after the other.
bool showed(const Bench &bench, uint8_t rgb) {
    const auto &colors = bench.board.outputs.colors;
    for (size_t i = 0; i + 1 < colors.size(); i++)
        if (colors[i].rgb == rgb && colors[i + 1].at - colors[i].at > MS) return true;
    return false;
}

}  // namespace

TEST_CASE("a sleeping robot is dark and deaf, and looks round each 8 s") {
    Bench bench("probe");
    bench.start();
    bench.ask(MOTORS, 255 | 255 << 8);
    bench.hear(make_message(SLEEP));
    bench.run_ms(100);
    bench.board.outputs.clear();
    CHECK(bench.board.left_duty() == 0);
    CHECK((bench.board.read(0x2A) | bench.board.read(0x27) | bench.board.read(0x24)) == 0);
    const uint32_t ticks = bench.ticks();
    const uint32_t loops = bench.word("loops", 4);
    bench.hear(make_message(WAKEUP));
    bench.run_ms(17000);
    CHECK(bench.state() == ROBOT_SLEEPING);
    CHECK(bench.ticks() - ticks <= 2);
    CHECK(bench.word("loops", 4) == loops);
    std::vector<Cycles> looks;
    for (const auto &color : bench.board.outputs.colors)
        if (color.rgb == WHITE) looks.push_back(color.at);
    REQUIRE(looks.size() == 2);
    const double period = double(looks[1] - looks[0]) / double(CYCLES_PER_SECOND);
    CHECK(period > 7.5);
    CHECK(period < 8.7);
    CHECK_FALSE(showed(bench, RED));
}

TEST_CASE("a robot sleeps as long, however often it is looked at meanwhile") {
    Bench bench("probe");
    bench.start();
    bench.hear(make_message(SLEEP));
    bench.board.outputs.clear();
    constexpr double QUANTUM_MS = 0.128;  // at such steps boards live together
    for (int i = 0; i < 60'000 / QUANTUM_MS; i++) bench.run_ms(QUANTUM_MS);
    std::vector<Cycles> looks;
    for (const auto &color : bench.board.outputs.colors)
        if (color.rgb == WHITE) looks.push_back(color.at);
    REQUIRE(looks.size() == 7);
    for (size_t i = 1; i < looks.size(); i++) {
        const double period = double(looks[i] - looks[i - 1]) / double(CYCLES_PER_SECOND);
        CHECK(period == doctest::Approx(8.2028).epsilon(1e-4));  // 8.192 s, and the look round
    }
}

TEST_CASE("WAKEUP, repeated, wakes a sleeping robot; it can be started again then") {
    Bench bench("probe");
    bench.start();
    bench.hear(make_message(SLEEP));
    bench.run_ms(1000);
    bench.board.outputs.clear();
    repeat(bench, make_message(WAKEUP), 8500);
    CHECK(bench.state() == ROBOT_IDLE);
    bench.start();
    const uint32_t ticks = bench.ticks();
    bench.run_ms(1000);
    CHECK(bench.ticks() - ticks >= 30);
    bench.hear(make_message(NORMAL), {100, 500});
    CHECK(bench.word("received_count", 2) == 1);
    CHECK(bench.low_gain() == 100);
}

TEST_CASE("a frame in the look round keeps the robot awake a while longer, lit red") {
    Bench bench("probe");
    bench.start();
    bench.hear(make_message(SLEEP));
    bench.board.outputs.clear();
    repeat(bench, make_message(NORMAL), 8500);
    CHECK(showed(bench, RED));
    CHECK(bench.word("received_count", 2) > 1);
    bench.run_ms(200);
    CHECK(bench.state() == ROBOT_SLEEPING);
    CHECK(bench.board.color() == 0);
}

}  // namespace test_sleep
