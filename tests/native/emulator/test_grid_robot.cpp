// Robot programs in the Kilogrid's flavour, with our helpers.
#include "module_bench.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_grid_robot {

namespace {

constexpr Cycles TENTH = SECOND / 10;

std::vector<Emission> sent_of_type(const Bench &bench, uint8_t type) {
    std::vector<Emission> found;
    for (const auto &emission : bench.sent(0))
        if (emission.message.type == type) found.push_back(emission);
    return found;
}

}  // namespace

TEST_CASE("a lab's robot program reports every two seconds with the helpers we bring") {
    Bench bench({"grid_robot"});
    bench.tell(0, 0, run_message());
    bench.run(60 * SECOND);
    const auto reports = sent_of_type(bench, TRACKING);
    REQUIRE(reports.size() > 25);
    for (size_t i = 2; i < reports.size(); i++) {  // the first waits for the robot's first turn
        const double gap = seconds(reports[i].at - reports[i - 1].at);
        CHECK(gap > 1.9);
        CHECK(gap < 2.7);  // two seconds of 62 ticks, and the wait for the robot's turn
    }
    CHECK(shown(bench.robot(0)) == RGB(0, 0, 1));
}

TEST_CASE("a lab's robot program avoids obstacle cells and drops something there") {
    Bench bench({"grid_robot"});
    bench.tell(0, 0, run_message());
    bench.tell(SECOND, 0, message(CELL_STATE, {2}));
    bench.run(2 * SECOND);
    CHECK(shown(bench.robot(0)) == RGB(0, 1, 0));
    CHECK(bench.robot(0).left_duty() == bench.robot(0).calibration().straight_left);
    bench.tell(2 * SECOND, 0, message(CELL_STATE, {9}));
    bench.run(3 * SECOND);
    CHECK(shown(bench.robot(0)) == RGB(1, 0, 0));
    CHECK(bench.robot(0).left_duty() > 0);
    CHECK(bench.robot(0).right_duty() == 0);
    bench.run(8 * SECOND);
    CHECK(sent_of_type(bench, DROP).size() == 1);
    const auto report = sent_of_type(bench, TRACKING).back().message;
    CHECK(report.data[2] == 2);
    CHECK(report.data[3] == 2);
}

TEST_CASE("the host moves a robot whose program does not run") {
    Bench bench({"grid_robot"});
    bench.tell(TENTH, 0, message(0x7E));  // TURN_LEFT
    bench.run(2 * TENTH);
    CHECK(bench.robot(0).left_duty() > 0);
    CHECK(bench.robot(0).right_duty() == 0);
    bench.tell(2 * TENTH, 0, message(0x7D));  // GO_STRAIGHT
    bench.run(3 * TENTH);
    CHECK(bench.robot(0).right_duty() > 0);
}

TEST_CASE("a robot and a module of lab programs hear one another") {
    ModuleBench cells("module_lab");
    Bench robots({"grid_robot"});
    cells.start({2, 9, 2, 2});
    robots.tell(cells.now, 0, run_message());
    size_t cells_said = 0, robots_said = 0;
    uint8_t under = 1;  // the obstacle
    for (int step = 0; step < 300; step++) {
        const Cycles until = cells.now + TENTH;
        cells.run(until);
        for (; cells_said < cells.sent.size(); cells_said++) {
            const auto &emission = cells.sent[cells_said];
            if (emission.cell == under) robots.tell(until, 0, emission.message);
        }
        robots.run(until);
        const auto sent = robots.sent(0);
        for (; robots_said < sent.size(); robots_said++)
            cells.module.receive_ir(until, under, sent[robots_said].message, {33, 33}, false);
        if (step == 100) under = 2;
    }
    cells.tell(frame({POLL}, 1));
    cells.run_for(20 * MS);
    CHECK(cells.frames[0].frame.data[1] == CAN_MESSAGE_BUFFER_SIZE);
    CHECK(cells.frames[1].frame.data[0] == (TRACKED | 1 << 6));
    bool dropped = false;
    for (const auto &emission : cells.sent_by(1)) dropped |= emission.message.data[1] > 0;
    CHECK(dropped);
    CHECK(shown(robots.robot(0)) == RGB(0, 1, 0));
}

}  // namespace test_grid_robot
