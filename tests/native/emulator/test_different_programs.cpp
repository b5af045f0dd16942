#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_different_programs {

namespace {

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("robots of different programs live in one world and hear one another") {
    Scene scene(square_hall(6));
    uint32_t sender = scene.add("sender", {{{0, 0}, 0}});
    uint32_t listener = scene.add("puppet", {{{0.4, 0}, 0}});
    uint32_t counter = scene.add("variables", {{{0, 0.4}, 0}});
    uint32_t crashing = scene.add("crashes", {{{2, 0}, 0}});
    scene.tell(0, listener, message(SAY, {1}));
    Simulation simulation(scene.def);
    simulation.advance(120);
    auto events = simulation.take_events();
    auto heard = texts(events, listener);
    REQUIRE(heard.size() >= 3);
    for (size_t i = 0; i < heard.size(); i++)
        CHECK(heard[i] == "5: " + std::to_string(i + 1) + " " + std::to_string(i) + ", 400 mm");
    CHECK(texts(events, sender).empty());
    CHECK(texts(events, counter).empty());  // its tick 50 lies before RUN
    CHECK(texts(events, crashing).empty());
    bool reported = false;
    for (const auto &event : events)
        if (event.robot == crashing + 0) {
            // The world's uids go on from group to group: uid 4 overflows its stack.
            CHECK(event.kind == EventKind::STACK_OVERFLOW);
            CHECK(event.program == "crashes");
            reported = true;
        }
    CHECK(reported);
}

TEST_CASE("two programs that use the same names do not meet") {
    // All of them define setup, loop, on_message, last, count.
    Bench bench({"variables", "paused", "variables", "waiting", "random"});
    for (uint32_t robot = 0; robot < 5; robot++) bench.tell(10, robot, run_message());
    bench.run(ticks(115), ticks(1));
    CHECK(bench.said(0) == Texts{"1050 -50 57 101 -52051 501 odd"});
    CHECK(bench.said(2) == Texts{"1150 -150 57 201 -154051 503 odd"});
    CHECK(bench.said(1).back() == "loop 110 at 110");
}

TEST_CASE("a group's robots are the ones after those of the groups before it") {
    Scene scene(square_hall(6));
    scene.add("puppet", {{{-1, 0}, 0}, {{0, 0}, 0}});
    scene.add("sender", {{{1, 0}, 0}});
    scene.tell(1, 1, message(COLOR, {RGB(3, 0, 0)}));
    Simulation simulation(scene.def);
    CHECK(simulation.size() == 3);
    simulation.advance(4);
    auto now = simulation.snapshot();
    CHECK(now.led == std::vector<uint8_t>{0, RGB(3, 0, 0), 0});
    CHECK(now.x_m == std::vector<float>{-1, 0, 1});
}

}  // namespace test_different_programs
