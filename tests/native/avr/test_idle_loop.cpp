// Time in which a program only waits is passed over, and that shows nowhere but in how seldom its
// board has to be run.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "avr/boards/robot_board.h"

using namespace kilotwin;

namespace test_idle_loop {

namespace {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
// The variables; not the stack, which may be a call deep or not.
constexpr uint16_t RAM_BEGIN = 0x100, RAM_END = 0x7FF;

struct Outcome {
    std::vector<uint8_t> memory;
    std::vector<Cycles> times;
    int runs = 0, rests = 0;  ///< of these runs, after how many the board could be left alone
    bool operator==(const Outcome &other) const {
        return memory == other.memory && times == other.times;
    }
};

Outcome run(const char *program, Cycles until, Cycles quantum, bool skip) {
    Chance chance(1);
    const auto image = FlashImage::load(std::string(PROGRAMS "/") + program + ".elf");
    RobotBoard board(*image, 0, {TICK_CYCLES, 1, 70, 70, 70, 70, InfraredGains()}, 0, chance);
    if (!skip) board.skip_nothing();
    Outcome outcome;
    uint64_t pulses = 0;
    Cycles next_pulse = 2 * MS;
    for (Cycles at = 0; at < until;) {
        at = std::min(at + quantum, until);
        while (next_pulse < at) {
            board.shine({next_pulse, next_pulse + 40, {100, 200}});
            next_pulse += 269 + chance.bits(0, Purpose::PLACE, pulses++) % (5 * MS);
            // Not while the last instruction of a run ends, which one that is passed over need not.
            if (next_pulse % quantum < 8) next_pulse += 8;
        }
        board.run(at);
        outcome.runs++;
        if (board.rests_until() > at + quantum) outcome.rests++;
    }
    for (uint16_t address = RAM_BEGIN; address <= RAM_END; address++)
        outcome.memory.push_back(board.read(address));
    for (const auto &color : board.outputs.colors) outcome.times.push_back(color.at);
    for (const auto &light : board.outputs.light) outcome.times.push_back(light.at);
    for (const auto &motor : board.outputs.motors) outcome.times.push_back(motor.at);
    for (const auto &serial : board.outputs.serial) outcome.times.push_back(serial.at);
    return outcome;
}

}  // namespace

TEST_CASE("passing over idle loops changes nothing, however far a board is run at once") {
    for (const char *program : {"waiting", "outputs", "receiver", "sensors", "boot"})
        for (Cycles quantum : {Cycles{800}, Cycles{10'007}, 700 * MS}) {
            CAPTURE(std::string(program));
            CAPTURE(quantum);
            CHECK(run(program, 700 * MS, quantum, true) == run(program, 700 * MS, quantum, false));
        }
    CHECK(run("waiting", 1000 * MS, 8000, true) == run("waiting", 1000 * MS, 8000, false));
    CHECK(run("sleeper", 4000 * MS, 8000, true) == run("sleeper", 4000 * MS, 8000, false));
}

TEST_CASE("a board that waits can be left alone nearly all the time") {
    for (const char *program : {"outputs", "receiver", "sensors"}) {
        CAPTURE(std::string(program));
        const Outcome every = run(program, 1000 * MS, 8000, false),
                      few = run(program, 1000 * MS, 8000, true);
        CHECK(few == every);
        CHECK(every.rests == 0);
        CHECK(10 * few.rests > 9 * few.runs);
    }
}

}  // namespace test_idle_loop
