// Running robots ahead changes the cost of a run, never its result.
#include <doctest/doctest.h>

#include <algorithm>
#include <tuple>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace {

/// All that can be known of a run.
struct Outcome {
    uint64_t hash = 0;
    std::vector<uint64_t> sample_hashes;
    std::vector<std::tuple<Cycles, uint32_t, uint32_t, EventKind, std::string>> events;
    Statistics statistics;
};

void note(Outcome &outcome, Simulation &simulation) {
    for (const auto &event : simulation.take_events())
        outcome.events.emplace_back(event.at, event.robot, event.tick, event.kind, event.text);
    auto samples = simulation.take_samples();
    size_t robots = simulation.size();
    for (size_t row = 0; row < samples.tick.size(); row++) {
        Samples one;
        for (uint32_t robot = 0; robot < robots; robot++)
            one.add_robot(pose_of(samples, robot, row), samples.led[row * robots + robot], 0);
        outcome.sample_hashes.push_back(result_hash(one));
    }
}

Outcome outcome_of(SimulationDef def, bool run_ahead, int64_t duration_ticks,
                   const std::vector<int64_t> &chunks) {
    def.run_ahead = run_ahead;
    Simulation simulation(def);
    Outcome outcome;
    for (size_t i = 0; simulation.tick() < duration_ticks; i++) {
        simulation.advance(std::min(chunks[i % chunks.size()], duration_ticks - simulation.tick()));
        note(outcome, simulation);
    }
    outcome.hash = result_hash(simulation.snapshot());
    outcome.statistics = simulation.statistics();
    return outcome;
}

void check_same(const Outcome &a, const Outcome &b) {
    CHECK(a.hash == b.hash);
    CHECK(a.sample_hashes == b.sample_hashes);
    REQUIRE(a.events.size() == b.events.size());
    auto [one, other] = std::mismatch(a.events.begin(), a.events.end(), b.events.begin());
    if (one != a.events.end()) {
        CHECK(std::get<Cycles>(*one) == std::get<Cycles>(*other));
        CHECK(std::get<1>(*one) == std::get<1>(*other));
        CHECK(std::get<std::string>(*one) == std::get<std::string>(*other));
    }
    CHECK(one == a.events.end());
    CHECK(a.statistics.steps == b.statistics.steps);
    CHECK(a.statistics.medium.sent == b.statistics.medium.sent);
    CHECK(a.statistics.medium.received == b.statistics.medium.received);
    CHECK(a.statistics.medium.wrong_crc == b.statistics.medium.wrong_crc);
    CHECK(a.statistics.solver_steps == b.statistics.solver_steps);
    CHECK(a.statistics.list_rebuilds == b.statistics.list_rebuilds);
    CHECK(a.statistics.overlaps.contacts() == b.statistics.overlaps.contacts());
    CHECK(a.statistics.overlaps.worst() == b.statistics.overlaps.worst());
    CHECK(a.statistics.overlaps.median() == b.statistics.overlaps.median());
}

void check_all_ways(const Scene &scene, int64_t duration_ticks) {
    auto ahead = outcome_of(scene.def, true, duration_ticks, {duration_ticks});
    check_same(ahead, outcome_of(scene.def, false, duration_ticks, {duration_ticks}));
    check_same(ahead, outcome_of(scene.def, true, duration_ticks, {1, 7, 3, 100, 2, 33}));
    check_same(ahead, outcome_of(scene.def, false, duration_ticks, {5, 64, 11}));
    MESSAGE(ahead.events.size() << " events, " << ahead.statistics.medium.received
                                << " frames heard, " << ahead.statistics.solver_steps
                                << " solver steps");
}

Arena with_sites(Arena arena) {
    double side = arena.bounds.size.x();
    arena.sites = {{Region::Shape::CIRCLE, {-side / 4, 0}, {side / 5, side / 5}},
                   {Region::Shape::RECTANGLE, {side / 4, side / 8}, {side / 4, side / 6}}};
    return arena;
}

constexpr int64_t DURATION_TICKS = 4000;

}  // namespace

TEST_CASE("sparse worlds: run ahead, tick by tick and in chunks give the same") {
    for (uint64_t seed = 1; seed <= 4; seed++) {
        CAPTURE(seed);
        Scene scene(with_sites(round_hall(20)), seed);
        scene.def.step_ticks = seed == 3 ? 1 : seed == 4 ? 4 : 2;
        if (seed % 2) scene.def.floor = VirtualFloor::Settings{};
        scene.def.line_of_sight = seed != 2;
        scene.def.sample_ticks = 101;
        scene.add_anywhere("wanderer", 25);
        check_all_ways(scene, DURATION_TICKS);
    }
}

TEST_CASE("dense worlds: run ahead, tick by tick and in chunks give the same") {
    for (uint64_t seed = 11; seed <= 14; seed++) {
        CAPTURE(seed);
        Scene scene(with_sites(seed % 2 ? round_hall(2.5) : square_hall(2.2)), seed);
        scene.def.step_ticks = seed == 13 ? 1 : seed == 14 ? 4 : 2;
        if (seed != 12) scene.def.floor = VirtualFloor::Settings{};
        scene.def.sample_ticks = 77;
        scene.add_anywhere("wanderer", 40);
        check_all_ways(scene, 1500);
    }
}

TEST_CASE("programs with delay(), waiting and failing ones among them: the same") {
    Scene scene(round_hall(5), 21);
    scene.def.floor = VirtualFloor::Settings{};
    scene.add_anywhere("wanderer", 10);
    scene.add_anywhere("timing", 3);
    scene.add_anywhere("callbacks", 3);
    scene.add_anywhere("variables", 3);
    scene.add_anywhere("sender", 3);
    scene.add_anywhere("paused", 3);
    scene.tell_all(700, message(WAKEUP));
    scene.tell_all(900, run_message());
    scene.tell(1111, 3, message(RESET));
    scene.tell(1200, 3, run_message());
    check_all_ways(scene, 2000);

    Scene waiting(round_hall(5), 22);
    waiting.add("waiting",
                {{{-1, 0}, 0}, {{-0.7, 0}, 0}, {{-0.4, 0}, 0}, {{0, 0}, 0}, {{0.3, 0}, 0}});
    waiting.add("sender", {{{0, 1}, 0}});
    waiting.add("wanderer", {{{0, -1}, 0}, {{1, -1}, 0}});
    check_all_ways(waiting, 2500);

    Scene failing(square_hall(12), 23);
    failing.add_anywhere("crashes", 10);
    failing.add_anywhere("wanderer", 10);
    check_all_ways(failing, 1000);
}

TEST_CASE("the paper's firmware: run ahead, tick by tick and in chunks give the same") {
    for (uint64_t seed : {31, 32}) {
        CAPTURE(seed);
        Arena arena = round_hall(seed == 31 ? 6 : 12);
        double diameter = seed == 31 ? 2 : 3;
        arena.sites = {{Region::Shape::CIRCLE, {-1.5, 0}, {diameter, diameter}},
                       {Region::Shape::CIRCLE, {1.5, 0}, {diameter, diameter}}};
        if (seed == 32) arena.sites[1].centre.x() = 3;
        Scene scene(arena, seed);
        scene.def.floor = VirtualFloor::Settings{};
        scene.add_anywhere("aggregation", 30);
        check_all_ways(scene, DURATION_TICKS);
    }
}
