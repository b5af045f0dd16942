#include "aggregation/wire.h"
#include "module_bench.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_sites {

namespace {

wire_cell_t said_by(const ModuleBench &bench, uint8_t cell) {
    const auto sent = bench.sent_by(cell);
    REQUIRE(!sent.empty());
    CHECK(sent.back().message.type == WIRE_TYPE_CELL);
    return wire_get_cell(sent.back().message.data);
}

}  // namespace

TEST_CASE("cells of sites say and show what the labs' codes mean") {
    ModuleBench bench("sites");
    bench.start({1, 2, 3, 4});
    bench.run_for(2 * SECOND);
    const uint8_t sites[] = {0, 0, 1, 2}, flags[] = {WIRE_CELL_WALL, 0, 0, 0},
                  colors[] = {1, 4, 7, 0};
    for (uint8_t cell = 0; cell < 4; cell++) {
        CHECK(said_by(bench, cell).site == sites[cell]);
        CHECK(said_by(bench, cell).flags == flags[cell]);
        CHECK(bench.module.light(cell, bench.now).color() == colors[cell]);
    }
}

TEST_CASE("cells that are told nothing are dark and silent") {
    ModuleBench bench("sites");
    bench.run(AWAKE);
    bench.tell({GO_SETUP});
    bench.tell({GO_RUN});
    bench.run_for(5 * SECOND);
    CHECK(bench.sent.size() == 40);  // RUN
    for (uint8_t cell = 0; cell < 4; cell++)
        CHECK(bench.module.light(cell, bench.now).color() == 0);
}

TEST_CASE("sites passes on what robots report, and nothing else") {
    ModuleBench bench("sites");
    bench.start({2, 2, 2, 2});
    bench.hear(3, tracking({9, 8, 7, 6, 5, 4, 3, 2, 1}));
    bench.hear(2, message(WIRE_TYPE_SIGNAL, {1}));
    bench.hear(1, tracking({1}), true);
    bench.tell(frame({POLL}, 1));
    bench.run_for(20 * MS);
    REQUIRE(bench.frames.size() == 2);
    CHECK(bench.frames[1].frame.data ==
          std::array<uint8_t, 8>{TRACKED | 3 << 6, 9, 8, 7, 6, 5, 4, 3});
}

TEST_CASE("the colours of sites are swapped while the module runs") {
    ModuleBench bench("sites");
    bench.start({3, 3, 4, 4});
    bench.run_for(3 * SECOND);
    bench.configure({4, 4, 3, 3});
    bench.run_for(10 * MS);
    CHECK(bench.module.light(0, bench.now).color() == 0);
    CHECK(bench.module.light(2, bench.now).color() == 7);
    bench.tell({GO_RUN});
    bench.run_for(2 * SECOND);
    CHECK(said_by(bench, 0).site == 2);
    CHECK(said_by(bench, 2).site == 1);
    CHECK(bench.module.light(2, bench.now).color() == 7);
}

TEST_CASE("lights and messages are right again a second after a pause") {
    ModuleBench bench("sites");
    bench.start({3, 4, 1, 2});
    bench.run_for(SECOND);
    bench.tell({FORWARD, 0});
    bench.tell({FORWARD, 1, 0, 0, 0, WAKEUP});
    bench.run_for(SECOND);
    bench.tell({STOP});
    bench.run_for(5 * SECOND);
    bench.sent.clear();
    bench.run_for(SECOND);
    CHECK(bench.sent.empty());
    bench.tell({GO_RUN});
    bench.run_for(2 * SECOND);
    CHECK(said_by(bench, 0).site == 1);
    CHECK(bench.module.light(2, bench.now).color() == 1);
}

}  // namespace test_sites
