// One Kilobot's board: what goes in as light, voltage and time, and what comes out at its pins.
#include <doctest/doctest.h>

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "avr/boards/robot_board.h"

using namespace kilotwin;

namespace test_robot_board {

namespace {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;

const Calibration CALIBRATION = {TICK_CYCLES, 0x1234, 71, 72, 73, 74, InfraredGains()};

/// A board with one of the test's programs, and names for its variables.
struct Bench {
    explicit Bench(const std::string &program, const Calibration &calibration = CALIBRATION,
                   Cycles power_up = 0)
        : image(FlashImage::load(PROGRAMS "/" + program + ".elf")),
          board(*image, 3, calibration, power_up, chance) {}

    uint16_t address(const std::string &name) const {
        auto found = image->symbol(name);
        REQUIRE_MESSAGE(found, name);
        return *found;
    }
    int byte(const std::string &name) const { return board.read(address(name)); }
    int word(const std::string &name, int index = 0) const {
        const auto at = static_cast<uint16_t>(address(name) + 2 * index);
        return board.read(at) | board.read(static_cast<uint16_t>(at + 1)) << 8;
    }

    Chance chance{1};
    std::shared_ptr<const FlashImage> image;
    RobotBoard board;
};

std::string text_of(const std::vector<BoardOutputs::Serial> &bytes) {
    std::string text;
    for (const auto &serial : bytes) text += static_cast<char>(serial.byte);
    return text;
}

}  // namespace

TEST_CASE("colour, motors, infrared and serial text leave the board with their times") {
    Bench bench("outputs");
    bench.board.run(20 * MS);
    const auto &out = bench.board.outputs;
    CHECK(bench.board.failure() == "");
    CHECK(bench.board.color() == (1 | 3 << 2));
    REQUIRE(out.motors.size() == 3);
    CHECK(out.motors[1].left == 70);
    CHECK(out.motors[1].right == 75);
    CHECK(out.motors[2].left == 0);
    CHECK(out.motors[2].right == 75);
    REQUIRE(out.light.size() == 6);
    CHECK(out.light[1].at - out.light[0].at == 9);
    CHECK(out.light[2].at - out.light[0].at == out.light[4].at - out.light[2].at);
    CHECK(text_of(out.serial) == "hello\n");
    // Ten bits at 38400 baud.
    const Cycles byte = out.serial[3].at - out.serial[2].at;
    CHECK(byte >= 2080);
    CHECK(byte <= 2120);
}

TEST_CASE("a board's oscillator may be slow, and it may be switched on later") {
    Calibration slow = CALIBRATION;
    slow.tick = TICK_CYCLES * 11 / 10;
    Bench nominal("outputs"), late("outputs", slow, 5 * MS);
    nominal.board.run(20 * MS);
    late.board.run(5 * MS);
    CHECK(late.board.outputs.motors.empty());
    CHECK(late.board.now() == 5 * MS);
    late.board.run(30 * MS);
    const Cycles from = nominal.board.outputs.motors[0].at, to = nominal.board.outputs.motors[2].at;
    const auto &motors = late.board.outputs.motors;
    REQUIRE(motors.size() == 3);
    CHECK(std::abs(double(motors[0].at - 5 * MS) - double(from) * 1.1) <= 1);
    CHECK(std::abs(double(motors[2].at - 5 * MS) - double(to) * 1.1) <= 1);
}

TEST_CASE("pulses of light trip the comparator and are measured on the gain that is chosen") {
    Bench bench("receiver");
    bench.board.run(1 * MS);
    bench.board.shine({1 * MS, 1 * MS + 40, {300, 600}});
    bench.board.shine({1 * MS + 2421, 1 * MS + 2461, {300, 600}});
    bench.board.run(2 * MS);
    CHECK(bench.byte("pulses") == 2);
    CHECK(bench.word("readings", 0) == 600);
    CHECK(bench.word("readings", 1) == 300);
    CHECK(std::abs(bench.word("times", 1) - bench.word("times", 0) - 2421) <= 4);
}

TEST_CASE("light from two senders at once holds the comparator's level and adds up") {
    Bench bench("receiver");
    bench.board.run(1 * MS);
    bench.board.shine({1 * MS + 200, 1 * MS + 300, {50, 100}});
    bench.board.shine({1 * MS + 250, 1 * MS + 650, {30, 70}});
    bench.board.shine({1 * MS + 650, 1 * MS + 850, {500, 900}});
    bench.board.run(1 * MS + 600);
    CHECK(bench.byte("level") == 1);
    bench.board.run(1 * MS + 800);
    CHECK(bench.byte("level") == 1);
    bench.board.run(2 * MS);
    CHECK(bench.byte("level") == 0);
    CHECK(bench.byte("pulses") == 1);
    CHECK(bench.word("readings", 0) == 100);
    // Measured while two shine, on the low gain, which the first pulse chose; too bright for the
    // converter.
    bench.board.shine({2 * MS, 2 * MS + 90, {900, 1000}});
    bench.board.shine({2 * MS, 2 * MS + 90, {900, 1000}});
    bench.board.run(3 * MS);
    CHECK(bench.word("readings", 1) == 1023);
}

TEST_CASE("sensors read what they are set to, with a lowest bit that is never still") {
    Bench bench("sensors");
    bench.board.readings[SENSOR_BATTERY] = 700;
    bench.board.readings[SENSOR_LIGHT] = 250;
    bench.board.readings[SENSOR_TEMPERATURE] = 330;
    bench.board.run(20 * MS);
    REQUIRE(bench.byte("done") == 1);
    auto check = [&](const char *name, int reading) {
        std::set<int> seen;
        int odd = 0;
        for (int i = 0; i < 64; i++) {
            seen.insert(bench.word(name, i));
            odd += bench.word(name, i) & 1;
        }
        CHECK(*seen.begin() == reading - 1);
        CHECK(*seen.rbegin() == reading + 1);
        // A fair coin 64 times: within four standard deviations of 32.
        CHECK(std::abs(odd - 32) <= 16);
    };
    check("battery", 700);
    check("light", 250);
    check("temperature", 330);
}

TEST_CASE("a reading stays within the converter's range") {
    Bench bench("sensors");
    bench.board.readings[SENSOR_BATTERY] = 0;
    bench.board.readings[SENSOR_LIGHT] = 1023;
    bench.board.run(20 * MS);
    for (int i = 0; i < 64; i++) {
        CHECK(bench.word("battery", i) <= 1);
        CHECK(bench.word("light", i) <= 1023);
    }
}

TEST_CASE("the charger pulls its pin low") {
    Bench bench("sensors");
    bench.board.run(20 * MS);
    CHECK(bench.byte("charging") == 0);
    bench.board.set_charging(true);
    bench.board.run(21 * MS);
    CHECK(bench.byte("charging") == 1);
}

TEST_CASE("the EEPROM holds the calibration where kilolib looks for it") {
    const auto bytes = eeprom_of(CALIBRATION);
    CHECK(bytes[0x01] == 0xFF);
    CHECK(bytes[0x05] == 71);
    CHECK(bytes[0x09] == 72);
    CHECK(bytes[0x0C] == 73);
    CHECK(bytes[0x14] == 74);
    CHECK((bytes[0x20] << 8 | bytes[0x21]) == CALIBRATION.gains.low(0));
    CHECK((bytes[0x6A] << 8 | bytes[0x6B]) == CALIBRATION.gains.high(13));
    CHECK(bytes[0x90] == 1);
    CHECK((bytes[0xB0] | bytes[0xB1] << 8) == 0x1234);
}

TEST_CASE("timers count, match and overflow when the datasheet says") {
    Bench bench("timers");
    bench.board.run(60 * MS);
    REQUIRE(bench.byte("done") == 1);
    // Polled, so a few cycles late; the flag comes with the count behind the match.
    auto about = [](int measured, int cycles) { return std::abs(measured - cycles) <= 16; };
    const int compare_values[] = {0, 1, 100, 255};
    for (int i = 0; i < 4; i++) {
        CAPTURE(compare_values[i]);
        CHECK(about(bench.word("match_period", i), 256 * 8));
        const int count = bench.board.read(static_cast<uint16_t>(bench.address("match_count") + i));
        CHECK(((count - compare_values[i] - 1) & 0xFF) <= 3);
    }
    CHECK(about(bench.word("overflow_period"), 256 * 8));
    CHECK(bench.byte("written") == 200);
    CHECK(about(bench.word("to_overflow"), 56 * 8));
    CHECK(about(bench.word("clear_period"), 100 * 8));
    CHECK(about(bench.word("fast_period"), 256 * 8));
    CHECK(std::abs(bench.byte("counts_of_1600") - 200) <= 3);
}

TEST_CASE(
    "an interrupt that is enabled late comes at once, and one that is disabled in time does not") {
    Bench bench("enables");
    bench.board.run(10 * MS);
    REQUIRE(bench.byte("done") == 1);
    CHECK(bench.byte("at_once") == 1);
    CHECK(bench.byte("late") == 1);
    CHECK(bench.byte("never") == 0);
    CHECK(bench.byte("edges") == 1);
}

TEST_CASE("a sleeping board wakes by its watchdog, and the watchdog resets it; the EEPROM stays") {
    Bench bench("sleeper");
    bench.board.run(900 * MS);
    CHECK(bench.byte("wakes") == 0);
    bench.board.run(1100 * MS);
    CHECK(bench.byte("wakes") == 1);
    CHECK(bench.byte("ticks") == 0);
    bench.board.run(2900 * MS);
    CHECK(bench.byte("starts") == 0);
    CHECK(bench.byte("ticks") > 20);  // awake, while it waits for the watchdog to reset it
    bench.board.run(4000 * MS);
    CHECK(bench.byte("starts") == 1);
    CHECK(bench.byte("cause") == 1 << 3);  // WDRF
    REQUIRE(bench.board.outputs.resets.size() == 1);
    const auto &[at, reset] = bench.board.outputs.resets[0];
    CHECK(at > 3000 * MS);
    CHECK(at < 3200 * MS);
    CHECK(reset.text().starts_with("its watchdog reset it: not fed for 1024 ms, at PC 0x0"));
    CHECK(reset.pc > 0);
    CHECK(bench.board.eeprom()[0x100] == 1);
    CHECK(bench.board.failure() == "");
}

TEST_CASE(
    "of many resets by the watchdog the 1st, 2nd, 4th, 8th are reported, each with its time") {
    std::vector<uint32_t> reported;
    for (uint32_t number = 1; number < 20; number++)
        if (WatchdogReset{number, 0, 0}.is_reported()) reported.push_back(number);
    CHECK(reported == std::vector<uint32_t>{1, 2, 4, 8, 16});
    CHECK(WatchdogReset{4, 0x1F2, 0}.text() ==
          "its watchdog reset it: not fed for 16 ms, at PC 0x01F2 (reset 4 by it; the program sees "
          "WDRF in MCUSR)");
    CHECK(WatchdogReset{1, 0, 0x21}.text().find("for 8192 ms") != std::string::npos);
}

TEST_CASE("a sleep that is quiet converts and waits; one that is deep hears nothing") {
    Bench bench("quiet");
    bench.board.readings[SENSOR_LIGHT] = 321;
    bench.board.run(20 * MS);
    CHECK(bench.byte("conversions") == 8);
    CHECK(std::abs(bench.word("reading") - 321) <= 1);
    CHECK(bench.byte("ticks") == 0);
    REQUIRE(bench.byte("asleep") == 1);
    bench.board.shine({21 * MS, 22 * MS, {300, 600}});
    bench.board.run(40 * MS);
    CHECK(bench.byte("edges") == 0);
    // Awake, it hears; without power its receiver shows nothing.
    bench.board.run(160 * MS);
    REQUIRE(bench.byte("asleep") == 0);
    bench.board.shine({161 * MS, 162 * MS, {300, 600}});
    bench.board.run(165 * MS);
    CHECK(bench.byte("edges") == 1);
    bench.board.run(250 * MS);
    REQUIRE(bench.byte("asleep") == 2);
    bench.board.shine({251 * MS, 252 * MS, {300, 600}});
    bench.board.run(260 * MS);
    CHECK(bench.byte("edges") == 1);
}

TEST_CASE("a loader alone is reached through erased flash, wherever its boot section begins") {
    for (const char *program : {"loader_7000", "loader_7800"}) {
        CAPTURE(program);
        Bench bench(program);
        bench.board.run(50 * MS);
        CHECK(bench.board.failure() == "");
        CHECK(bench.byte("boot_interrupts") >= 3);
        CHECK(bench.byte("programmed") == 1);
    }
}

TEST_CASE("an EEPROM section in the file is programmed over the calibration") {
    for (const char *type : {".elf", ".hex"}) {
        Chance chance{1};
        const auto image = FlashImage::load(std::string(PROGRAMS "/with_eeprom") + type);
        RobotBoard board(*image, 3, CALIBRATION, 0, chance);
        const auto eeprom = board.eeprom();
        CHECK(eeprom[0x05] == 99);
        CHECK(eeprom[0x09] == 72);
        // It says that the IR LED is on PB1, too.
        CHECK(eeprom[0x90] == 3);
        board.run(10 * MS);
        REQUIRE(board.outputs.light.size() == 4);
        CHECK(board.outputs.light[1].at - board.outputs.light[0].at <= 4);
    }
}

TEST_CASE("a boot loader is entered by way of the wrapped program counter and programs the flash") {
    Bench bench("boot");
    CHECK(bench.board.flash(0x4000) == 0xFF);
    bench.board.run(50 * MS);
    CHECK(bench.board.failure() == "");
    CHECK(bench.byte("programmed") == 1);
    CHECK(bench.board.flash(0x4000) == 0x00);
    CHECK(bench.board.flash(0x4001) == 0x5A);
    CHECK(bench.board.flash(0x407E) == 0x7E);
    CHECK(bench.byte("boot_interrupts") >= 3);
}

TEST_CASE("a program that cannot go on stands still and says where") {
    auto failure = [](const char *program) {
        Bench bench(program);
        bench.board.run(10 * MS);
        bench.board.run(20 * MS);
        return bench.board.failure();
    };
    CHECK(failure("bad_opcode").rfind("bad opcode 0x0001 at PC 0x00", 0) == 0);
    CHECK(failure("no_memory")
              .rfind("it writes to address 0x2345, where there is no memory, at PC 0x00", 0) == 0);
    CHECK(failure("sleeps_for_ever") == "it sleeps with interrupts off, so nothing can wake it");
}

TEST_CASE("how far a board is run at once does not change what it does") {
    auto transcript = [](Cycles quantum) {
        Bench bench("outputs");
        for (Cycles at = quantum; at <= 21 * MS; at += quantum) bench.board.run(at);
        std::ostringstream text;
        for (const auto &light : bench.board.outputs.light)
            text << light.at << ' ' << light.on << '\n';
        for (const auto &motor : bench.board.outputs.motors)
            text << motor.at << ' ' << int(motor.left) << ' ' << int(motor.right) << '\n';
        for (const auto &serial : bench.board.outputs.serial) text << serial.at << '\n';
        return text.str();
    };
    const auto at_once = transcript(21 * MS);
    CHECK(transcript(200) == at_once);
    CHECK(transcript(2689) == at_once);
}

TEST_CASE("a trace tells a wave viewer what the pins did") {
    std::string path = std::filesystem::temp_directory_path() / "kilotwin-test-XXXXXX";
    close(mkstemp(path.data()));
    {
        Bench bench("outputs");
        bench.board.trace(path);
        bench.board.run(10 * MS);
    }
    std::ifstream file(path);
    const std::string text(std::istreambuf_iterator<char>(file), {});
    CHECK(text.find(
              "$timescale 1ns $end\n$scope module robot_3 $end\n$var wire 1 ! ir_out $end\n") == 0);
    size_t pulses = 0;
    for (size_t at = 0; (at = text.find("\n1!\n", at)) != std::string::npos; at++) pulses++;
    CHECK(pulses == 3);
    CHECK(text.find("b01000110 #") != std::string::npos);  // left motor: 70
    std::remove(path.c_str());
}

}  // namespace test_robot_board
