// A hex file as those published were built: another runtime than ours (programs/original.c), which
// drives the same pins in its own way, and has to live with our robots, native ones, and the
// overhead controller.
#include <doctest/doctest.h>

#include <cmath>

#include "../settings.h"
#include "base/message_crc.h"
#include "infrared/infrared_pulses.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_original_runtime {

namespace {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
constexpr uint8_t NORMAL_TYPE = 0, RESET_TYPE = 0x83, SLEEP_TYPE = 0x84, RUN_TYPE = 0x88;
enum : int { IDLE, RUNNING, SLEEPING };
constexpr uint8_t GREEN = 1 << 2, RED_AND_GREEN = 1 | 1 << 2;

/// One of them on the bench.
struct Bench {
    uint16_t address(const std::string &name) const { return *image->symbol(name); }
    int byte(const std::string &name) const { return board.read(address(name)); }
    int word(const std::string &name) const {
        return byte(name) | board.read(static_cast<uint16_t>(address(name) + 1)) << 8;
    }
    void run_ms(double ms) { board.run(board.now() + static_cast<Cycles>(ms * double(MS))); }

    /// Shines a frame on it and waits until it has been taken.
    void hear(uint8_t type) {
        message_t message = {};
        message.data[0] = 42;
        message.type = static_cast<decltype(message.type)>(type);
        message.crc = crc_of(message);
        for (Cycles offset : pulses_of(message)) {
            const Cycles at = board.now() + 100 + offset;
            board.shine({at, at + RobotBoard::SEEN_PULSE, {300, 600}});
        }
        run_ms(6);
    }

    Chance chance{1};
    std::shared_ptr<const FlashImage> image = FlashImage::load(PROGRAMS "/original.elf");
    RobotBoard board{*image, 3, {TICK_CYCLES, 0x34, 71, 72, 73, 74, InfraredGains()}, 0, chance};
};

}  // namespace

TEST_CASE("another runtime blinks while it waits, each 201 ms") {
    Bench bench;
    bench.run_ms(2000);
    const auto &colors = bench.board.outputs.colors;
    REQUIRE(colors.size() >= 18);
    CHECK(colors[0].rgb == GREEN);
    CHECK(std::abs(double(colors[2].at - colors[0].at) / double(MS) - 201) < 0.5);
    CHECK(bench.word("ticks") == 61);  // 30.52 a second
}

TEST_CASE("another runtime starts by RUN, moves, hears and measures both gains, and talks") {
    Bench bench;
    bench.run_ms(100);
    bench.hear(RUN_TYPE);
    REQUIRE(bench.byte("state") == RUNNING);
    CHECK(bench.board.left_duty() == 70);
    CHECK(bench.board.right_duty() == 60);
    bench.hear(NORMAL_TYPE);
    CHECK(bench.byte("heard") == 1);
    CHECK(bench.byte("from") == 42);
    CHECK(bench.word("high") == 600);
    CHECK(bench.word("low") == 300);
    bench.board.outputs.clear();
    bench.run_ms(10'000);
    CHECK(bench.byte("sent") == 19);  // each 524 ms
    PulseReader reader;
    int messages = 0;
    for (const auto &edge : bench.board.outputs.light) {
        if (!edge.on) continue;
        const auto found = reader.pulse(edge.at);
        CHECK(found != PulseReader::Found::NONSENSE);
        if (found != PulseReader::Found::MESSAGE) continue;
        messages++;
        CHECK(crc_is_right(reader.message()));
        CHECK(reader.message().data[0] == 0x34);
    }
    CHECK(messages == 19);
}

TEST_CASE("RESET from within an interrupt begins the program anew") {
    Bench bench;
    bench.run_ms(100);
    bench.hear(RUN_TYPE);
    bench.run_ms(1000);
    const int starts = bench.byte("starts");
    bench.hear(RESET_TYPE);
    CHECK(((bench.byte("starts") - starts) & 0xFF) == 1);
    CHECK(bench.byte("state") == IDLE);
    CHECK(bench.board.left_duty() == 0);
    CHECK(bench.word("ticks") == 0);
    bench.run_ms(1000);
    CHECK(std::abs(bench.word("ticks") - 30) <= 1);
    bench.hear(RUN_TYPE);
    CHECK(bench.byte("state") == RUNNING);
}

TEST_CASE("SLEEP is power-down, deaf and dark, with a look round each 8 s; it can be woken then") {
    Bench bench;
    bench.run_ms(100);
    bench.hear(RUN_TYPE);
    bench.hear(SLEEP_TYPE);
    bench.run_ms(500);
    CHECK(bench.byte("state") == SLEEPING);
    CHECK(bench.board.color() == 0);
    const int ticks = bench.word("ticks");
    bench.hear(NORMAL_TYPE);
    CHECK(bench.byte("heard") == 0);
    bench.board.outputs.clear();
    bench.run_ms(17'000);
    CHECK(bench.word("ticks") - ticks <= 2);
    const int starts = bench.byte("starts");
    int looks = 0;
    for (const auto &color : bench.board.outputs.colors) looks += color.rgb == RED_AND_GREEN;
    CHECK(looks == 2);
    for (int i = 0; i < 1500 && bench.byte("state") == SLEEPING; i++) bench.hear(RESET_TYPE);
    CHECK(bench.byte("state") == IDLE);
    // The watchdog is off again: it only ever woke it.
    bench.run_ms(10'000);
    CHECK(((bench.byte("starts") - starts) & 0xFF) == 1);
}

TEST_CASE("while the channel is held busy it retries at random and ticks faster, for ever") {
    Bench bench;
    bench.run_ms(100);
    bench.hear(RUN_TYPE);
    bench.run_ms(1000);
    const int ticks = bench.word("ticks");
    // Steady light is one edge: the receiver gives up, the comparator's level stays.
    bench.board.shine({bench.board.now() + 1, bench.board.now() + 600'000 * MS, {300, 600}});
    bench.run_ms(60'000);
    const double per_second = (bench.word("ticks") - ticks) / 60.0;
    CHECK(per_second > 56);
    CHECK(per_second < 61);
    // Among so many draws some were 0, after which the timer has to go on.
    bench.run_ms(60'000);
    CHECK(bench.word("ticks") - ticks > 2 * 56 * 60);
}

TEST_CASE("other runtimes, ours and native robots hear one another") {
    constexpr double DURATION_S = 30, SPACING_M = 0.035;
    auto def = definition({{Region::Shape::RECTANGLE, {0, 0}, {3, 3}}, {}});
    def.seed = 4;
    def.profile = small_robot();
    auto exact = infrared_settings();
    exact.range_spread = exact.loss = exact.loss_at_range = exact.gain_noise_lsb = 0;
    def.kilobot_medium = exact;
    def.clock_spread = 0.01;
    // In reach of each other, and nearly at rest.
    def.groups.push_back({PROGRAMS "/original.hex", "original", 1, {{{0, 0}, 0}}, Tier::CHIP});
    def.groups.push_back({PROGRAMS "/mate.hex", "mate", 1, {{{SPACING_M, 0}, 0}}, Tier::CHIP});
    def.groups.push_back({GUESTS "/mate.so", "mate", 1, {{{0, SPACING_M}, 0}}, Tier::NATIVE});
    def.profile.speed_m_s = 1e-6;
    def.profile.turn_rad_s = 1e-6;
    message_t run = {};
    run.type = static_cast<decltype(run.type)>(RUN_TYPE);
    def.commands.push_back({0, 0, 65535, run});
    Simulation simulation(def);
    simulation.advance(static_cast<int64_t>(DURATION_S / TICK_S));
    const auto &board = simulation.boards().board(0);
    const auto image = FlashImage::load(PROGRAMS "/original.elf");
    const int said = static_cast<int>(DURATION_S / (16 * TICK_S));
    // Of two neighbours, and some frames collide.
    const int heard = board.read(*image->symbol("heard"));
    CHECK(heard > 2 * said * 9 / 10);
    CHECK(board.read(*image->symbol("sent")) >= said - 2);
    // These show how many they have heard, modulo 64.
    for (size_t robot : {1u, 2u}) CHECK(simulation.robot(robot).color(0) > 2 * said * 9 / 10 - 64);
}

}  // namespace test_original_runtime
