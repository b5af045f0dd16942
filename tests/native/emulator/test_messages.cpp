// Messages between robots in a world.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_messages {

namespace {

using Texts = std::vector<std::string>;

constexpr uint8_t HELLO = 9;

std::vector<int64_t> heard_at(const Simulation &simulation, const Events &events, uint32_t robot) {
    std::vector<int64_t> out;
    for (const auto &event : events)
        if (event.robot == robot) out.push_back(simulation.tick_of(event.at));
    return out;
}

}  // namespace

TEST_CASE("a message is received by all in range, with the distance, every 16 ticks") {
    Scene scene(square_hall(6));
    scene.add("puppet",
              {{{0, 0}, 0}, {{0.4, 0}, 0}, {{0.79, 0.01}, 0}, {{0, 0.81}, 0}, {{0, -0.79}, 0}});
    scene.tell_all(0, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {HELLO}));
    Simulation simulation(scene.def);
    simulation.advance(160);
    auto events = simulation.take_events();
    CHECK(texts(events, 0).empty());
    CHECK(texts(events, 1) == Texts(10, "9: 1 0, 400 mm"));
    CHECK(texts(events, 2).empty());  // behind robot 1
    CHECK(texts(events, 3).empty());  // out of range
    CHECK(texts(events, 4) == Texts(10, "9: 1 0, 790 mm"));
    CHECK(simulation.statistics().medium.sent == 10);
    CHECK(simulation.statistics().medium.received == 20);
    CHECK(simulation.statistics().medium.wrong_crc == 0);
}

TEST_CASE("walls do not stop a message") {
    Scene scene(round_hall(3));
    scene.add("puppet", {{{1.3, 0.3}, 0}, {{1.3, -0.3}, 0}});
    scene.tell_all(0, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {HELLO}));
    Simulation simulation(scene.def);
    simulation.advance(32);
    CHECK(texts(simulation.take_events(), 1) == Texts(2, "9: 1 0, 600 mm"));
}

TEST_CASE("a frame with a wrong CRC is received by no robot") {
    Scene scene(square_hall(6));
    scene.add("puppet", {{{0, 0}, 0}, {{0.4, 0}, 0}});
    scene.tell_all(0, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {HELLO, 1}));
    scene.tell(80, 0, message(SEND, {HELLO}));
    Simulation simulation(scene.def);
    simulation.advance(160);
    auto events = simulation.take_events();
    auto heard = heard_at(simulation, events, 1);
    CHECK(heard.size() == 5);
    CHECK(heard.front() >= 80);
    CHECK(simulation.statistics().medium.sent == 10);
    CHECK(simulation.statistics().medium.wrong_crc == 5);
    CHECK(simulation.statistics().medium.received == 5);
}

TEST_CASE("frames that no robot could receive are counted like all others") {
    for (bool run_ahead : {true, false}) {
        Scene scene(square_hall(6));
        scene.add("puppet", {{{0, 0}, 0}});
        scene.tell(0, 0, message(SEND, {HELLO, 1}));
        scene.def.run_ahead = run_ahead;
        Simulation simulation(scene.def);
        simulation.advance(160);
        CHECK(simulation.statistics().medium.sent == 10);
        CHECK(simulation.statistics().medium.wrong_crc == 10);
    }
}

TEST_CASE("a frame is heard after it is over, and not before the next world step") {
    for (uint32_t step : {1u, 2u, 4u}) {
        Scene scene(square_hall(6));
        scene.def.step_ticks = step;
        scene.add("puppet", {{{0, 0}, 0}, {{0.4, 0}, 0}});
        scene.tell_all(0, message(SAY, {1}));
        scene.tell(0, 0, message(SEND, {HELLO}));
        Simulation simulation(scene.def);
        simulation.advance(40);
        auto events = simulation.take_events();
        REQUIRE(events.size() >= 2);
        for (const auto &event : events) {
            // The sender's own ticks are 16 apart, anywhere within a tick since RUN.
            CHECK((event.at - events[0].at) % ticks(16) <= ticks(step));
            CHECK(simulation.tick_of(event.at) >= static_cast<int64_t>(step));
        }
    }
}

TEST_CASE("a robot that drives out of range, after brushing past another, is no longer received") {
    // Robot 1 passes robot 2 so closely that both go through the solver, then drives on freely.
    Scene scene(square_hall(8));
    scene.add("puppet", {{{0, 0}, 0}, {{0.3, 0}, 0}, {{0.55, 0.1705}, 0}});
    scene.tell_all(0, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {HELLO}));
    scene.motors(1, 1, FULL, FULL);
    Simulation simulation(scene.def);
    simulation.advance(400);
    CHECK(simulation.statistics().solver_steps > 0);
    Pose end = pose_of(simulation.snapshot(), 1);
    CHECK(end.position.x() > 1.5);
    CHECK(std::abs(end.position.y()) < 0.001);
    auto events = simulation.take_events();
    auto heard = heard_at(simulation, events, 1);
    REQUIRE(heard.size() > 5);
    // 0.5 m to the end of the range, at 0.1 m/s from tick 1 on.
    double metres = (static_cast<double>(heard.back()) - 1) * TICK_S * 0.1;
    CHECK(metres > 0.5 - 0.1 * 17 * TICK_S);
    CHECK(metres < 0.5 + 0.1 * 3 * TICK_S);
    // Its distance is told as it was.
    for (const auto &event : events) {
        if (event.robot != 1) continue;
        double x = 0.3 + (static_cast<double>(simulation.tick_of(event.at)) - 1) * TICK_S * 0.1;
        int mm = std::stoi(event.text.substr(event.text.find(',') + 1));
        CHECK(std::abs(mm - 1000 * x) < 12);
    }
}

TEST_CASE("a robot that comes into range is received at once") {
    Scene scene(square_hall(8));
    scene.add("puppet", {{{0, 0}, 0}, {{-1.6, 0}, 0}});
    scene.tell(0, 1, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {HELLO}));
    scene.motors(1, 1, FULL, FULL);
    Simulation simulation(scene.def);
    simulation.advance(400);
    auto heard = heard_at(simulation, simulation.take_events(), 1);
    REQUIRE(heard.size() > 5);
    double metres = (static_cast<double>(heard.front()) - 1) * TICK_S * 0.1;
    CHECK(metres > 0.8 - 0.1 * 3 * TICK_S);
    CHECK(metres < 0.8 + 0.1 * 18 * TICK_S);
}

TEST_CASE("a robot that steps between two hides one from the other") {
    Scene scene(square_hall(8));
    scene.add("puppet", {{{-0.3, 0}, 0}, {{0.3, 0}, 0}, {{0, -0.6}, M_PI / 2}});
    scene.tell(0, 1, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {HELLO}));
    scene.motors(1, 2, FULL, FULL);
    Simulation simulation(scene.def);
    simulation.advance(400);
    // It hides robot 0 while it is within its radius of the line between them.
    for (int64_t tick : heard_at(simulation, simulation.take_events(), 1)) {
        double y = -0.6 + static_cast<double>(tick - 1) * TICK_S * 0.1;
        CHECK(std::abs(y) > 0.085 - 0.1 * 4 * TICK_S);
    }
    CHECK(simulation.statistics().medium.sent == 25);
    // 0.17 m of shadow at 0.1 m/s: 52 ticks, 3 or 4 frames.
    CHECK(simulation.statistics().medium.received >= 25 + 21);
}

}  // namespace test_messages
