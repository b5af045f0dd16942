/// States, their lights, and commands (hardware.md 1.3, 1.4).
#include "bench.h"
#include "kilolib/core/calibration.h"
#include "kilolib/core/eeprom_map.h"

using namespace kilotwin;

namespace test_commands {

namespace {

constexpr int RECORD_BYTES = 10;
constexpr uint8_t GREEN = 0x0C, BLUE = 0x30, RED = 0x03, YELLOW = 0x0F, DIM_RED = 0x01;

message_t calibration(calibration_mode_t mode, uint16_t uid = 0, uint8_t turn_left = 0,
                      uint8_t turn_right = 0, uint8_t straight_left = 0,
                      uint8_t straight_right = 0) {
    return make_message(CALIB, {static_cast<uint8_t>(mode), static_cast<uint8_t>(uid),
                                static_cast<uint8_t>(uid >> 8), turn_left, turn_right,
                                straight_left, straight_right});
}

/// The duties set since `motors` was cleared, as (left, right, ms it lasted; 0 for the last).
struct Drive {
    int left, right;
    double ms;
};
std::vector<Drive> drives(const Bench &bench) {
    std::vector<Drive> result;
    const auto &motors = bench.board.outputs.motors;
    for (size_t i = 0; i < motors.size(); i++) {
        const bool last = i + 1 == motors.size();
        const double ms = last ? 0 : double(motors[i + 1].at - motors[i].at) / double(MS);
        if (last || ms > 0.1) result.push_back({motors[i].left, motors[i].right, ms});
    }
    return result;
}

}  // namespace

TEST_CASE("an idle robot blinks green, 1 ms each 201.2 ms") {
    Bench bench("probe");
    bench.run_ms(2000);
    std::vector<Cycles> on, off;
    for (const auto &color : bench.board.outputs.colors) {
        if (color.rgb == GREEN) on.push_back(color.at);
        if (color.rgb == 0) off.push_back(color.at);
    }
    REQUIRE(on.size() >= 9);
    REQUIRE(off.size() >= 9);
    for (size_t i = 1; i < on.size(); i++) {
        const double period = double(on[i] - on[i - 1]) / double(MS);
        CHECK(period > 200.9);
        CHECK(period < 201.6);
    }
    CHECK(double(off[2] - on[2]) / double(MS) < 1.05);
}

TEST_CASE("RUN calls setup() once, WAKEUP pauses, and a second RUN goes on with loop()") {
    Bench bench("probe");
    bench.start();
    CHECK(bench.byte("setups") == 1);
    bench.hear(make_message(RUN));
    CHECK(bench.byte("setups") == 1);
    bench.hear(make_message(WAKEUP));
    bench.run_ms(1);
    CHECK(bench.state() == ROBOT_IDLE);
    const uint32_t loops = bench.word("loops", 4);
    bench.run_ms(100);
    CHECK(bench.word("loops", 4) == loops);
    bench.start();
    CHECK(bench.byte("setups") == 1);
    CHECK(bench.word("loops", 4) > loops);
}

TEST_CASE("a pause stops the motors, and after the RUN they wait for set_motors()") {
    Bench bench("probe");
    bench.start();
    bench.ask(MOTORS, 70 | 80 << 8);
    CHECK(bench.board.left_duty() == 70);
    CHECK(bench.board.right_duty() == 80);
    bench.hear(make_message(WAKEUP));
    CHECK(bench.board.left_duty() == 0);
    CHECK(bench.board.right_duty() == 0);
    bench.start();
    CHECK(bench.board.left_duty() == 0);
    CHECK(bench.board.right_duty() == 0);
    bench.ask(MOTORS, 70 | 80 << 8);
    CHECK(bench.board.left_duty() == 70);
}

TEST_CASE("motors do not turn before RUN, whatever the program sets") {
    Bench bench("probe");
    bench.run_ms(20);
    bench.board.write(0xB3, 200);
    bench.board.write(0xB4, 200);
    bench.run_ms(300);
    CHECK(bench.board.left_duty() == 0);
    CHECK(bench.board.right_duty() == 0);
}

TEST_CASE("spinup_motors() gives full power for 15 ms") {
    Bench bench("probe");
    bench.start();
    bench.board.outputs.clear();
    bench.ask(SPINUP);
    bench.ask(MOTORS, 0);
    auto driven = drives(bench);
    REQUIRE(!driven.empty());
    CHECK(driven[0].left == 255);
    CHECK(driven[0].right == 255);
    CHECK(driven[0].ms > 15);
    CHECK(driven[0].ms < 15.5);
}

TEST_CASE("each colour lights its pins") {
    Bench bench("probe");
    bench.start();
    for (uint16_t rgb = 0; rgb < 64; rgb++) {
        bench.ask(COLOR, rgb);
        CHECK(bench.board.color() == rgb);
    }
}

TEST_CASE("RESET starts the program again from its beginning") {
    Bench bench("probe");
    bench.start();
    bench.ask(MOTORS, 255 | 255 << 8);
    bench.run_ms(2000);
    CHECK(bench.ticks() >= 60);
    bench.hear(make_message(RESET));
    CHECK(bench.state() == ROBOT_IDLE);
    CHECK(bench.ticks() == 0);
    CHECK(bench.byte("setups") == 0);
    CHECK(bench.board.left_duty() == 0);
    bench.start();
    CHECK(bench.byte("setups") == 1);
    bench.hear(make_message(NORMAL));
    CHECK(bench.word("received_count", 2) == 1);
    CHECK(bench.ask(RAND_SOFT) == 0xFD);
}

TEST_CASE("BOOT jumps into the boot section") {
    Bench bench("boot_section");
    bench.run_ms(20);
    const Cycles before = bench.board.now();
    bench.hear(make_message(BOOT));
    REQUIRE(!bench.board.outputs.colors.empty());
    CHECK(bench.board.outputs.colors.back().rgb == RED);
    CHECK(bench.board.outputs.colors.back().at > before);
    CHECK(bench.board.failure() == "");
}

TEST_CASE("VOLTAGE shows the battery's state as a colour") {
    for (auto [reading, color] :
         {std::pair<int16_t, uint8_t>{700, GREEN}, {660, BLUE}, {630, YELLOW}, {600, RED}}) {
        Bench bench("probe");
        bench.board.readings[SENSOR_BATTERY] = reading;
        bench.start();
        bench.hear(make_message(VOLTAGE));
        bench.run_ms(2);
        CHECK(bench.board.color() == color);
        bench.hear(make_message(WAKEUP));
        bench.run_ms(3);
        CHECK(bench.board.color() == 0);
    }
}

TEST_CASE("CHARGE blinks red while the charger is at work") {
    Bench bench("probe");
    bench.start();
    bench.hear(make_message(CHARGE));
    bench.run_ms(300);
    bench.board.outputs.clear();
    bench.run_ms(1000);
    CHECK(bench.board.outputs.colors.empty());
    bench.board.set_charging(true);
    bench.run_ms(1010);
    int reds = 0;
    for (const auto &color : bench.board.outputs.colors) reds += color.rgb == DIM_RED;
    CHECK(reds == 5);
}

TEST_CASE("READUID turns left for a bit that is set and stops for one that is not") {
    Bench bench("probe", 0x8005);
    bench.run_ms(20);
    for (uint8_t bit = 0; bit < 16; bit++) {
        bench.board.outputs.clear();
        bench.hear(make_message(READUID, {bit}));
        bench.run_ms(230);
        const bool set = 0x8005 >> bit & 1;
        CHECK(bench.board.left_duty() == (set ? 61 : 0));
        CHECK(bench.board.right_duty() == 0);
        if (set) CHECK(drives(bench)[0].left == 255);
    }
}

TEST_CASE("CALIB tries motor values, with a kick for the motors concerned only") {
    struct {
        message_t message;
        uint8_t left, right;
    } const trials[] = {{calibration(CALIBRATION_TURN_LEFT, 0, 71), 71, 0},
                        {calibration(CALIBRATION_TURN_RIGHT, 0, 0, 72), 0, 72},
                        {calibration(CALIBRATION_STRAIGHT, 0, 0, 0, 73, 74), 73, 74}};
    Bench bench("probe");
    bench.run_ms(20);
    for (const auto &trial : trials) {
        bench.board.outputs.clear();
        for (int i = 0; i < 20; i++) bench.hear(trial.message);
        auto driven = drives(bench);
        REQUIRE(driven.size() == 2);
        CHECK(driven[0].left == (trial.left ? 255 : 0));
        CHECK(driven[0].right == (trial.right ? 255 : 0));
        CHECK(driven[0].ms > 15);
        CHECK(driven[0].ms < 19);  // frames come in meanwhile
        CHECK(driven[1].left == trial.left);
        CHECK(driven[1].right == trial.right);
    }
    bench.hear(calibration(CALIBRATION_UID));
    bench.run_ms(20);
    CHECK(bench.board.left_duty() == 0);
    CHECK(bench.board.right_duty() == 0);
}

TEST_CASE("CALIB saves uid and motor values after a trial, and only then") {
    Bench bench("probe");
    bench.run_ms(20);
    const auto before = bench.board.eeprom();
    const message_t save = calibration(CALIBRATION_SAVE, 0x1234, 81, 82, 83, 84);
    bench.hear(save);
    bench.run_ms(50);
    CHECK(bench.board.eeprom() == before);
    bench.hear(calibration(CALIBRATION_STRAIGHT, 0, 0, 0, 73, 74));
    bench.run_ms(20);
    bench.hear(save);
    bench.run_ms(50);
    auto expected = before;
    expected[EEPROM_UID] = 0x34;
    expected[EEPROM_UID + 1] = 0x12;
    expected[EEPROM_TURN_LEFT] = 81;
    expected[EEPROM_TURN_RIGHT] = 82;
    expected[EEPROM_STRAIGHT_LEFT] = 83;
    expected[EEPROM_STRAIGHT_RIGHT] = 84;
    auto after = bench.board.eeprom();
    for (uint16_t record : {EEPROM_RECORD_1, EEPROM_RECORD_2})
        std::copy_n(before.begin() + record, RECORD_BYTES, after.begin() + record);
    CHECK(after == expected);
    CHECK(bench.state() == ROBOT_IDLE);
    CHECK(bench.board.left_duty() == 0);
    CHECK(bench.word("kilo_uid", 2) == 0x1234);
    CHECK(bench.byte("kilo_straight_left") == 83);
}

TEST_CASE("CALIB with a mark is for the robot of its uid alone") {
    Bench bench("probe");
    bench.run_ms(20);
    const auto uid = static_cast<uint16_t>(bench.word("kilo_uid", 2));
    auto marked = [](message_t message) {
        message.data[CALIB_MARK] = CALIB_MARK_LOW;
        message.data[CALIB_MARK + 1] = CALIB_MARK_HIGH;
        return make_message(CALIB, {message.data, message.data + sizeof message.data});
    };
    auto trial = [&](uint16_t to) {
        return marked(calibration(CALIBRATION_STRAIGHT, to, 0, 0, 73, 74));
    };
    bench.hear(trial(uid + 1));
    bench.hear(trial(uid ^ 0x100));
    CHECK(bench.state() == ROBOT_IDLE);
    bench.hear(trial(uid));
    bench.run_ms(20);
    CHECK(bench.board.left_duty() == 73);
    const auto before = bench.board.eeprom();
    bench.hear(marked(calibration(CALIBRATION_SAVE, uid + 1, 81, 82, 83, 84)));
    bench.run_ms(100);
    CHECK(bench.board.left_duty() == 73);
    CHECK(bench.board.eeprom() == before);
    bench.hear(marked(calibration(CALIBRATION_SAVE, uid, 81, 82, 83, 84)));
    bench.run_ms(100);
    CHECK(bench.board.eeprom()[EEPROM_TURN_LEFT] == 81);
    CHECK(bench.word("kilo_uid", 2) == uid);
}

TEST_CASE("an unknown command changes nothing") {
    Bench bench("probe");
    bench.start();
    for (uint8_t type : {0x81, 0x82, 0x8B, 0xFF}) bench.hear(make_message(type));
    CHECK(bench.state() == ROBOT_RUNNING);
    CHECK(bench.word("received_count", 2) == 0);
}

}  // namespace test_commands
