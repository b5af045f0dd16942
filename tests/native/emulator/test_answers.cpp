// Questions for vitals, which a robot's runtime answers beside its program.
#include <doctest/doctest.h>

#include "kilolib/core/calibration.h"
#include "kilolib/core/robot_query.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_answers {

namespace {

message_t question(uint8_t slots, uint8_t nonce = 0, uint16_t uid = ROBOT_QUERY_ALL) {
    return message(BOOTPGM_QUERY, {ROBOT_QUERY_VITALS, slots, nonce, static_cast<uint8_t>(uid),
                                   static_cast<uint8_t>(uid >> 8)});
}

bool is_answer(const Emission &emission) { return emission.message.type == BOOTPGM_REPORT; }

/// When a robot sent its program's messages, in ticks.
std::vector<double> own_messages(const Bench &bench) {
    std::vector<double> when;
    for (const auto &emission : bench.sent(0))
        if (!is_answer(emission)) when.push_back(seconds(emission.at) / TICK_S);
    return when;
}

std::vector<Emission> answers(const Bench &bench) {
    std::vector<Emission> found = bench.sent(0);
    std::erase_if(found, [](const Emission &emission) { return !is_answer(emission); });
    return found;
}

uint8_t state_told(const Emission &emission) { return emission.message.data[REPORT_STATE]; }

}  // namespace

TEST_CASE("a robot answers in its slot, counted in ticks, in every state but sleep") {
    const std::pair<uint8_t, uint8_t> states[] = {
        {NORMAL, ROBOT_IDLE},     {RUN, ROBOT_RUNNING},    {VOLTAGE, ROBOT_BATTERY},
        {CHARGE, ROBOT_CHARGING}, {READUID, ROBOT_MOVING}, {WAKEUP, ROBOT_IDLE}};
    for (const auto &each : states) {
        const uint8_t type = each.first, state = each.second;
        CAPTURE(type);
        Bench bench({"paused"});
        bench.tell(ticks(3), 0, message(type));
        bench.tell(ticks(10) + 5, 0, question(8, 9));
        bench.run(ticks(300));
        const uint16_t uid = bench.robot(0).uid();
        const auto told = answers(bench);
        REQUIRE(told.size() == 1);
        CHECK(told[0].at == ticks(11 + robot_query_slot(uid, 9, 8)));
        const auto *data = told[0].message.data;
        CHECK((data[0] | data[1] << 8) == uid);
        CHECK((data[3] | data[6] >> 6 << 8) == bench.robot(0).voltage(told[0].at));
        CHECK(state_told(told[0]) == ROBOT_REPORT_IN_PROGRAM + state);
    }
    Bench bench({"paused"});
    bench.tell(ticks(3), 0, message(SLEEP));
    for (uint64_t at = 4; at < 600; at++) bench.tell(ticks(at), 0, question(0));
    bench.run(ticks(700));
    CHECK(answers(bench).empty());
}

TEST_CASE("a robot tells how strongly it last heard another's vitals") {
    Bench bench({"paused"});
    message_t vitals = message(BOOTPGM_REPORT, {99, 0, ROBOT_QUERY_VITALS});
    for (int count = 1; count <= 5; count++) {
        const auto at = static_cast<uint64_t>(100 * count);
        bench.tell(ticks(at), 0, vitals, static_cast<int16_t>(700 + count));
        bench.tell(ticks(at + 50), 0, question(0));
    }
    bench.run(ticks(700));
    const auto told = answers(bench);
    REQUIRE(told.size() == 5);
    for (int count = 1; count <= 5; count++) {
        const auto *data = told[static_cast<size_t>(count - 1)].message.data;
        CHECK((data[4] | (data[6] & 3) << 8) == 700 + count);
        CHECK((data[5] | (data[6] >> 2 & 3) << 8) == 700 + count);
        CHECK((data[6] >> 4 & 3) == count % 4);
    }
}

TEST_CASE("an entry of the gain tables is saved, told, and used from the next start on") {
    Bench bench({"paused"});
    auto entry_3 = message(BOOTPGM_QUERY, {ROBOT_QUERY_GAINS + 3, 0, 0, 0xFF, 0xFF});
    const uint16_t uid = bench.robot(0).uid();
    auto save = message(CALIB, {CALIBRATION_GAINS + 3, static_cast<uint8_t>(uid),
                                static_cast<uint8_t>(uid >> 8), 0x01, 0x2C, 0x02, 0x9B, 'K', 'T'});
    bench.tell(ticks(10), 0, entry_3);
    bench.tell(ticks(20), 0, save);
    bench.tell(ticks(30), 0, entry_3);
    bench.run(ticks(50));
    const auto told = answers(bench);
    REQUIRE(told.size() == 2);
    const InfraredGains &gains = bench.robot(0).calibration().gains;
    const auto *before = told[0].message.data, *after = told[1].message.data;
    CHECK((before[3] << 8 | before[4]) == gains.low(3));
    CHECK((before[5] << 8 | before[6]) == gains.high(3));
    CHECK((after[3] << 8 | after[4]) == 0x012C);
    CHECK((after[5] << 8 | after[6]) == 0x029B);
    CHECK(state_told(told[1]) == robot_report_state(ROBOT_QUERY_GAINS + 3, ROBOT_IDLE));
}

TEST_CASE("SLEEP ends an answer that is due, and a question for another robot is none") {
    Bench bench({"paused"});
    const uint16_t uid = bench.robot(0).uid();
    bench.tell(ticks(2), 0, question(0, 0, static_cast<uint16_t>(uid + 1)));
    bench.tell(ticks(5) + 5, 0, question(0));
    bench.tell(ticks(5) + 6, 0, message(SLEEP));
    bench.run(ticks(700));
    CHECK(answers(bench).empty());
}

TEST_CASE("a program notices nothing of answers, but that a tick of its own may be taken") {
    Bench asked({"talker"}), left_alone({"talker"});
    for (Bench *bench : {&asked, &left_alone}) bench->tell(ticks(1), 0, run_message());
    for (uint64_t at = 20; at < 900; at += 7) asked.tell(ticks(at) + 5, 0, question(2, 1));
    for (Bench *bench : {&asked, &left_alone}) bench->run(ticks(1000));
    CHECK(answers(asked).size() > 100);
    CHECK(asked.said(0) == left_alone.said(0));
    const auto with = own_messages(asked), without = own_messages(left_alone);
    REQUIRE(with.size() <= without.size());
    CHECK(with.size() + 8 >= without.size());
    for (size_t i = 1; i < with.size(); i++) {
        const double period = with[i] - with[i - 1];
        CHECK((period == doctest::Approx(16) || period == doctest::Approx(17)));
    }
}

TEST_CASE("an answer that finds the channel busy is tried four times, tick after tick") {
    Scene scene(square_hall(3));
    scene.def.profile = small_robot();
    scene.def.profile.legs = true;
    auto held = infrared_settings();
    scene.def.kilobot_medium = held;
    scene.add("paused", {{{0, 0}, 0}});
    scene.def.commands.clear();
    scene.tell(10, 0, question(0));
    for (bool busy : {false, true}) {
        scene.def.kilobot_medium->held_busy = busy;
        Simulation simulation(scene.def);
        simulation.advance(100);
        CHECK(simulation.statistics().medium.sent == (busy ? 0 : 1));
        CHECK(simulation.statistics().medium.attempts_failed == (busy ? 4 : 0));
    }
}

TEST_CASE("answers of a swarm are the same run ahead and tick by tick") {
    Scene scene(square_hall(1), 5);
    scene.def.profile = small_robot();
    scene.def.profile.legs = true;
    scene.def.clock_spread = 0.01;
    scene.add_anywhere("talker", 20);
    for (int64_t at = 30; at < 900; at += 90)
        scene.tell_all(at, question(6, static_cast<uint8_t>(at)));
    for (bool medium : {false, true}) {
        CAPTURE(medium);
        if (medium) scene.def.kilobot_medium = infrared_settings();
        uint64_t sent[2], received[2], failed[2];
        for (bool ahead : {false, true}) {
            scene.def.run_ahead = ahead;
            Simulation simulation(scene.def);
            simulation.advance(1000);
            const auto counts = simulation.statistics().medium;
            sent[ahead] = counts.sent;
            received[ahead] = counts.received;
            failed[ahead] = counts.attempts_failed;
        }
        CHECK(sent[0] == sent[1]);
        CHECK(received[0] == received[1]);
        CHECK(failed[0] == failed[1]);
        CHECK(sent[0] > 20 * 1000 / 16 + 100);
    }
}

}  // namespace test_answers
