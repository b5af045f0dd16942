// Questions of the host to robots by a module, and their answers to the host.
#include "base/message_crc.h"
#include "kilolib/core/robot_query.h"
#include "module_bench.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_module_questions {

namespace {

constexpr uint8_t ASK = 0x19, REPORTED = 0x1A;

message_t answer_of(uint8_t uid) {
    return message(BOOTPGM_REPORT, {uid, 0x12, ROBOT_QUERY_VITALS, 1, 2, 3, 4, 0x12, 9});
}

std::array<uint8_t, 8> reported(uint8_t uid, uint8_t cell) {
    return {static_cast<uint8_t>(REPORTED | cell << 6), uid, 0x12, 1, 2, 3, 4, 0x12};
}

}  // namespace

TEST_CASE("a question of the host goes out once by each cell, then the module listens") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    bench.tell({FORWARD, 0, 1, 2, 3, 4, 5, 6});
    bench.tell({FORWARD, 1, 7, 8, 9, VOLTAGE});
    bench.run_for(200 * MS);
    for (int time = 0; time < 2; time++) {
        bench.tell({ASK, ROBOT_QUERY_VITALS, 4, 7, 0xFF, 0xFF});
        bench.run_for(30 * MS);
        bench.sent.erase(bench.sent.begin(), bench.sent.end() - 4);
        for (uint8_t cell = 0; cell < 4; cell++) {
            const auto &[at, by, question] = bench.sent[cell];
            CHECK(by == cell);
            CHECK(question.type == BOOTPGM_QUERY);
            CHECK(question.data[QUERY_FIRST] == ROBOT_QUERY_VITALS);
            CHECK(question.data[QUERY_SLOTS] == 4);
            CHECK(question.data[QUERY_NONCE] == 7);
            CHECK(question.data[8] == 0);
            CHECK(robot_query_is_for(question.data, 99));
            CHECK(crc_is_right(question));
        }
        bench.sent.clear();
        bench.run_for(SECOND);
        CHECK(bench.sent.empty());
        CHECK(bench.module.state() == Module::State::IDLE);
    }
}

TEST_CASE("a module that runs does not ask") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.tell({ASK, ROBOT_QUERY_VITALS, 4, 7, 0xFF, 0xFF});
    bench.run_for(SECOND);
    for (const auto &emission : bench.sent) CHECK(emission.message.type != BOOTPGM_QUERY);
}

TEST_CASE("a robot's answer goes to the host at once, in every state, and not to the program") {
    ModuleBench running("module_lab"), idle("module_lab");
    running.start({1, 2, 3, 4});
    idle.run(AWAKE);
    for (ModuleBench *bench : {&running, &idle}) {
        const size_t events = bench->events.size();
        for (uint8_t cell = 0; cell < 4; cell++) {
            const Cycles heard = bench->now;
            bench->hear(cell, answer_of(cell));
            REQUIRE(bench->frames.size() == 1);
            CHECK(bench->frames[0].at == heard);
            CHECK(bench->frames[0].frame.id == ((Y + 1) << 6 | (X + 1) << 1 | 1));
            CHECK(bench->frames[0].frame.dlc == 8);
            CHECK(bench->frames[0].frame.data == reported(cell, cell));
            bench->frames.clear();
        }
        bench->hear(0, answer_of(9), true);  // wrong checksum
        CHECK(bench->frames.empty());
        CHECK(bench->events.size() == events);
    }
}

TEST_CASE("an answer is the next thing that a module does, however it is run ahead") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    const Cycles at = bench.now + 3 * MS;
    bench.module.receive_ir(at, 1, answer_of(5), {40, 40}, false);
    CHECK(bench.module.next_event() == at);
    bench.run(at + 1);
    REQUIRE(bench.frames.size() == 1);
    CHECK(bench.frames[0].at == at);
}

}  // namespace test_module_questions
