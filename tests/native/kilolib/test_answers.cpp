/// Answers to questions for vitals on the chip (boot_loaders.md 5.1).
#include "bench.h"
#include "kilolib/core/calibration.h"
#include "kilolib/core/gains.h"
#include "kilolib/core/robot_query.h"

using namespace kilotwin;

namespace test_answers {

namespace {

constexpr Cycles TICK = TICK_CYCLES;
constexpr uint16_t UID = 7;

message_t question(uint8_t slots, uint8_t nonce) {
    return make_message(BOOTPGM_QUERY, {ROBOT_QUERY_VITALS, slots, nonce, 0xFF, 0xFF});
}

std::vector<Frame> answers_of(Bench &bench) {
    std::vector<Frame> answers;
    for (const Frame &frame : frames_of(bench.board.outputs.light))
        if (frame.message.type == BOOTPGM_REPORT) answers.push_back(frame);
    return answers;
}

}  // namespace

TEST_CASE("a robot answers in its slot with voltage and state, and counts its ticks on") {
    const std::pair<uint8_t, robot_state_t> states[] = {{WAKEUP, ROBOT_IDLE},
                                                        {RUN, ROBOT_RUNNING},
                                                        {VOLTAGE, ROBOT_BATTERY},
                                                        {CHARGE, ROBOT_CHARGING},
                                                        {READUID, ROBOT_MOVING}};
    for (const auto &each : states) {
        const uint8_t command = each.first, state = each.second;
        CAPTURE(command);
        Bench bench("probe", UID);
        bench.board.noise = [](uint8_t, int16_t reading) { return reading; };
        bench.run_ms(100);
        bench.hear(make_message(command));
        bench.run_ms(100);
        const int16_t voltage =
            state == ROBOT_RUNNING ? bench.ask(VOLTAGE_READING) : static_cast<int16_t>(-1);
        bench.board.outputs.light.clear();
        const uint32_t ticks = bench.ticks();
        const Cycles since = bench.board.now();
        bench.hear(question(4, 5));
        const Cycles asked = bench.board.now();
        bench.run_ms(700);
        const auto answers = answers_of(bench);
        REQUIRE(answers.size() == 1);
        CHECK(answers[0].crc_is_right);
        const Cycles slot = robot_query_slot(UID, 5, 4) * TICK;
        CHECK(answers[0].begin + MS > asked + slot);
        CHECK(answers[0].begin < asked + slot + TICK + MS);
        const uint8_t *data = answers[0].message.data;
        CHECK((data[0] | data[1] << 8) == UID);
        CHECK(data[2] == ROBOT_QUERY_VITALS);
        const int told = data[3] | data[6] >> 6 << 8;
        if (voltage >= 0) CHECK(told == voltage);
        CHECK(told > 500);
        CHECK(data[7] == ROBOT_REPORT_IN_PROGRAM + state);
        const auto passed = static_cast<double>(bench.board.now() - since) / double(TICK);
        CHECK(double(bench.ticks() - ticks) == doctest::Approx(passed).epsilon(0.06));
    }
}

TEST_CASE("a chip tells how strongly it last heard another's vitals, and keeps entries of tables") {
    Bench bench("probe", UID);
    bench.board.noise = [](uint8_t, int16_t reading) { return reading; };
    bench.run_ms(100);
    auto answer_to = [&bench](uint8_t first) {
        bench.board.outputs.light.clear();
        bench.hear(make_message(BOOTPGM_QUERY, {first, 0, 0, 0xFF, 0xFF}));
        bench.run_ms(60);
        const auto answers = answers_of(bench);
        REQUIRE(answers.size() == 1);
        return answers[0].message;
    };
    for (int count = 1; count <= 5; count++) {
        const distance_measurement_t gains = {static_cast<int16_t>(300 + count), 900};
        bench.hear(make_message(BOOTPGM_REPORT, {99, 0, ROBOT_QUERY_VITALS}), gains);
        const auto told = answer_to(ROBOT_QUERY_VITALS);
        CHECK((told.data[4] | (told.data[6] & 3) << 8) == 300 + count);
        CHECK((told.data[5] | (told.data[6] >> 2 & 3) << 8) == 900);
        CHECK((told.data[6] >> 4 & 3) == count % 4);
    }
    for (uint8_t entry = 0; entry < GAIN_ENTRIES; entry++) {
        const auto mode = static_cast<uint8_t>(ROBOT_QUERY_GAINS + entry);
        bench.hear(make_message(CALIB, {mode, UID, 0, 0x01, entry, 0x02, entry, 'K', 'T'}));
        bench.run_ms(100);
    }
    for (uint8_t entry = 0; entry < GAIN_ENTRIES; entry++) {
        const auto told = answer_to(static_cast<uint8_t>(ROBOT_QUERY_GAINS + entry));
        CHECK((told.data[3] << 8 | told.data[4]) == (0x100 | entry));
        CHECK((told.data[5] << 8 | told.data[6]) == (0x200 | entry));
        CHECK(told.data[REPORT_STATE] ==
              robot_report_state(static_cast<uint8_t>(ROBOT_QUERY_GAINS + entry), ROBOT_IDLE));
    }
}

TEST_CASE("a robot that sleeps does not answer") {
    Bench bench("probe", UID);
    bench.run_ms(100);
    bench.hear(question(2, 0));
    bench.hear(make_message(SLEEP));
    bench.run_ms(9000);
    CHECK(answers_of(bench).empty());
}

TEST_CASE("an answer that finds the channel busy is given up after four ticks") {
    Bench bench("probe", UID);
    bench.run_ms(100);
    bench.hear(question(0, 0));
    // Light that is never over: frames back to back.
    for (int i = 0; i < 50; i++)
        bench.shine_frame(bench.board.now() + static_cast<Cycles>(i) * 37 * MS / 8, make_message(1),
                          {300, 600});
    bench.run_ms(1000);
    // Not more than the begin of a frame for each of four attempts: a pulse, on and off.
    CHECK(bench.board.outputs.light.size() <= 8);
    bench.hear(question(0, 0));
    bench.run_ms(50);
    CHECK(bench.board.outputs.light.size() > 8);
}

TEST_CASE("a program's own messages go on beside answers") {
    Bench bench("probe", UID);
    bench.start();
    bench.set("talks", 255, 1);
    bench.run_ms(600);
    bench.board.outputs.light.clear();
    for (int i = 0; i < 20; i++) {
        bench.hear(question(1, static_cast<uint8_t>(i)));
        bench.run_ms(150);
    }
    size_t own = 0, answers = 0;
    for (const Frame &frame : frames_of(bench.board.outputs.light)) {
        CHECK(frame.crc_is_right == (frame.message.type == BOOTPGM_REPORT));
        (frame.message.type == BOOTPGM_REPORT ? answers : own)++;
    }
    CHECK(answers >= 18);
    CHECK(own >= 5);
    CHECK(own <= 7);
}

}  // namespace test_answers
