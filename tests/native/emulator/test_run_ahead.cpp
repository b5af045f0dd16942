// Running robots ahead, and by several threads, changes the cost of a run, never its result.
#include <doctest/doctest.h>

#include <algorithm>
#include <tuple>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_run_ahead {

namespace {

/// All that can be known of a run.
struct Outcome {
    uint64_t hash = 0;
    std::vector<uint64_t> sample_hashes;
    std::vector<std::tuple<int, int, int, uint32_t, uint32_t>> extras;  ///< of each row
    std::vector<std::tuple<Cycles, uint32_t, uint32_t, EventKind, std::string>> events;
    Statistics statistics;
    std::vector<std::vector<uint8_t>> variables;  ///< by robot, in the end
};

void note(Outcome &outcome, Simulation &simulation) {
    for (const auto &event : simulation.take_events())
        // Where a program is loaded to differs from thread to thread.
        outcome.events.emplace_back(event.at, event.robot, event.tick, event.kind,
                                    text_without_address(event));
    auto samples = simulation.take_samples();
    size_t robots = simulation.size();
    for (size_t row = 0; row < samples.tick.size(); row++) {
        Samples one;
        for (uint32_t robot = 0; robot < robots; robot++)
            one.add_robot(pose_of(samples, robot, row), samples.led[row * robots + robot], 0);
        outcome.sample_hashes.push_back(final_hash(one));
    }
    for (size_t i = 0; i < samples.led.size(); i++)
        outcome.extras.emplace_back(samples.left_duty[i], samples.right_duty[i], samples.battery[i],
                                    samples.sent[i], samples.received[i]);
}

Outcome outcome_of(SimulationDef def, bool run_ahead, int64_t duration_ticks,
                   const std::vector<int64_t> &chunks, uint32_t threads = 1) {
    def.run_ahead = run_ahead;
    def.threads = threads;
    def.sample_extras = {true, true, true};
    def.battery_h = 0.02;  // it falls from sample to sample
    Simulation simulation(def);
    Outcome outcome;
    for (size_t i = 0; simulation.tick() < duration_ticks; i++) {
        simulation.advance(std::min(chunks[i % chunks.size()], duration_ticks - simulation.tick()));
        note(outcome, simulation);
    }
    outcome.hash = final_hash(simulation.snapshot());
    outcome.statistics = simulation.statistics();
    for (size_t robot = 0; robot < simulation.size(); robot++)
        outcome.variables.push_back(simulation.robot(robot).variables());
    return outcome;
}

constexpr uint32_t TEAM = 3;

/// The outcome, but for variables of robots whose program a team loads elsewhere: they may point to
/// it.
Outcome comparable(Outcome one) {
    const size_t robots = one.variables.size();
    one.variables.resize(robots / std::min<size_t>(TEAM, robots));
    return one;
}

void check_same(const Outcome &a, const Outcome &b) {
    CHECK(a.hash == b.hash);
    CHECK(a.sample_hashes == b.sample_hashes);
    CHECK((a.extras == b.extras));  // too many to be shown
    REQUIRE(a.events.size() == b.events.size());
    auto [one, other] = std::mismatch(a.events.begin(), a.events.end(), b.events.begin());
    if (one != a.events.end()) {
        CHECK(std::get<Cycles>(*one) == std::get<Cycles>(*other));
        CHECK(std::get<1>(*one) == std::get<1>(*other));
        CHECK(std::get<std::string>(*one) == std::get<std::string>(*other));
    }
    CHECK(one == a.events.end());
    CHECK((a.variables == b.variables));
    CHECK(a.statistics.steps == b.statistics.steps);
    CHECK(a.statistics.medium.sent == b.statistics.medium.sent);
    CHECK(a.statistics.medium.received == b.statistics.medium.received);
    CHECK(a.statistics.medium.wrong_crc == b.statistics.medium.wrong_crc);
    CHECK(a.statistics.medium.attempts_failed == b.statistics.medium.attempts_failed);
    CHECK(a.statistics.medium.collided == b.statistics.medium.collided);
    CHECK(a.statistics.medium.deaf == b.statistics.medium.deaf);
    CHECK(a.statistics.medium.lost == b.statistics.medium.lost);
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
    // A team for a short time: on a loaded machine each loop that it shares waits for its turn.
    const int64_t short_ticks = std::min<int64_t>(duration_ticks, 500);
    check_same(comparable(outcome_of(scene.def, true, short_ticks, {short_ticks})),
               comparable(outcome_of(scene.def, true, short_ticks, {1, 7, 3, 100, 2, 33}, TEAM)));
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

TEST_CASE("sparse worlds: run ahead, tick by tick, in chunks and by threads give the same") {
    for (uint64_t seed = 1; seed <= 4; seed++) {
        CAPTURE(seed);
        Scene scene(with_sites(round_hall(20)), seed);
        scene.def.step_ticks = seed == 3 ? 1 : seed == 4 ? 4 : 2;
        if (seed % 2) scene.def.floor = floor_settings();
        scene.def.line_of_sight = seed != 2;
        scene.def.sample_ticks = 101;
        scene.add_anywhere("wanderer", 25);
        check_all_ways(scene, DURATION_TICKS);
    }
}

TEST_CASE("dense worlds: run ahead, tick by tick, in chunks and by threads give the same") {
    for (uint64_t seed = 11; seed <= 14; seed++) {
        CAPTURE(seed);
        Scene scene(with_sites(seed % 2 ? round_hall(2.5) : square_hall(2.2)), seed);
        scene.def.step_ticks = seed == 13 ? 1 : seed == 14 ? 4 : 2;
        if (seed != 12) scene.def.floor = floor_settings();
        scene.def.sample_ticks = 77;
        scene.add_anywhere("wanderer", 40);
        check_all_ways(scene, 1500);
    }
}

TEST_CASE("polygons, obstacles and polygons as sites: all ways give the same") {
    for (uint64_t seed = 61; seed <= 64; seed++) {
        CAPTURE(seed);
        Arena arena = {
            Region::polygon({{-2, -1.5}, {2, -1.2}, {0.6, 0}, {2.2, 1.6}, {-1.8, 1.5}}),
            {Region::polygon({{-1, -1}, {0.4, -0.9}, {-0.2, -0.4}, {-0.3, 0.6}}),
             Region{Region::Shape::RECTANGLE, {0, 0}, {0.8, 0.3}}.placed({0.8, 0.9}, 0.6)},
            {{{Region::Shape::CIRCLE, {-1.2, 0.6}, {0.4, 0.4}}, true},
             {Region{Region::Shape::RECTANGLE, {0, 0}, {0.8, 0.02}}.placed({0.1, 0.3}, 1), true}}};
        arena.build_walls(true, seed % 2 ? 0.3 : 0.1);
        Scene scene(arena, seed);
        scene.def.step_ticks = seed == 63 ? 1 : seed == 64 ? 4 : 2;
        if (seed != 62) scene.def.floor = floor_settings();
        scene.def.sample_ticks = 77;
        scene.add_anywhere("wanderer", 25);
        if (seed == 62) {
            scene.def.light.sources = {{{0.5, 0.8}, 900, 0.5}};
            scene.add_anywhere("light_watcher", 3);
        }
        check_all_ways(scene, 1500);
    }
}

TEST_CASE("a program settles its period if only its set-up changes it") {
    CHECK(Program::load(guest("wanderer"), "wanderer").settles_period());
    CHECK_FALSE(Program::load(guest("sender"), "sender").settles_period());  // it is told periods
    CHECK_FALSE(Program::load(guest("talker"), "talker").names_period());
}

TEST_CASE("the Kilobot medium: run ahead, tick by tick, in chunks and by threads give the same") {
    for (uint64_t seed = 31; seed <= 34; seed++) {
        CAPTURE(seed);
        Scene scene = crowd_on_kilobot_medium(seed);
        scene.tell(300, 12, message(0x30, {200, 0}));  // a short period
        scene.tell(500, 13, message(0x31, {1}));       // asked at each tick, and silent
        scene.tell(800, 13, message(0x31, {0}));
        check_all_ways(scene, 1500);
    }
}

TEST_CASE("the Kilobot medium and a floor: all ways give the same") {
    for (uint64_t seed = 31; seed <= 34; seed++) {
        CAPTURE(seed);
        Scene scene = crowd_on_kilobot_medium(seed);
        scene.def.floor = floor_settings();
        check_all_ways(scene, 1500);
    }
}

TEST_CASE(
    "programs that never send: run ahead, tick by tick, in chunks and by threads give the same") {
    for (uint64_t seed = 71; seed <= 73; seed++) {
        CAPTURE(seed);
        Scene scene(square_hall(seed == 71 ? 1.8 : 4), seed);
        if (seed != 73) scene.def.kilobot_medium = infrared_settings();
        if (seed != 73) scene.def.kilobot_medium->range_m = 0.6;
        scene.def.sample_ticks = 77;
        scene.add_anywhere("listener", 10);
        scene.add_anywhere("wanderer", 5);
        scene.tell(400, 3, message(RESET));
        scene.tell(500, 3, run_message());
        check_all_ways(scene, 1500);
    }
}

namespace {

/// Bits of the program `seldom`: all but CHATS, in many combinations.
uint8_t habits_of(uint32_t robot) {
    return static_cast<uint8_t>(robot * 11 % 64 + (robot % 5 == 0 ? 128 : 0));
}

/// Robots that mostly have nothing to say, in steps of 1, 2 or 4 ticks; some of them chat, and some
/// always speak.
Scene seldom_scene(uint64_t seed, double side_m, size_t seldom, size_t chatting, size_t wanderers) {
    Scene scene(square_hall(side_m), seed);
    scene.def.kilobot_medium = infrared_settings();
    scene.def.kilobot_medium->range_m = 0.6;
    scene.def.step_ticks = 1u << seed % 3;
    scene.def.sample_ticks = 77;
    scene.def.clock_spread = seed % 2 ? 0.005 : 0;
    scene.add_anywhere("seldom", seldom);
    const uint32_t first = scene.add_anywhere("seldom", chatting);
    for (uint32_t robot = first; robot < first + chatting; robot++)
        scene.tell(5, robot, message(0x40, {64}));
    scene.add_anywhere("wanderer", wanderers);
    return scene;
}

}  // namespace

TEST_CASE("programs with seldom anything to say: run ahead, tick by tick and in chunks are alike") {
    for (uint64_t seed = 81; seed <= 84; seed++) {
        CAPTURE(seed);
        Scene scene = seldom_scene(seed, seed % 2 ? 1.8 : 5, 16, 3, seed == 84 ? 4 : 0);
        for (uint32_t robot = 0; robot < 16; robot++)
            scene.tell(20, robot, message(0x40, {habits_of(robot)}));
        scene.tell(700, 2, message(RESET));
        scene.tell(800, 2, run_message());
        scene.tell(900, 4, message(VOLTAGE));
        scene.tell(1000, 4, run_message());
        check_all_ways(scene, 1500);
    }
}

TEST_CASE("programs with seldom anything to say, whose ticks coincide: all ways are alike") {
    for (uint64_t seed = 92; seed <= 94; seed += 2) {
        CAPTURE(seed);
        Scene scene = seldom_scene(seed, 1.8, 14, 6, 2);
        // Robots that go to sleep together wake together: then they have one phase. They listen
        // for the third time after 751 ticks. They do not look at their sensors: what these read in
        // the very cycle in which light begins is left open.
        scene.tell_all(20, message(SLEEP));
        scene.tell_all(771, message(WAKEUP));
        scene.tell_all(780, run_message());
        for (uint32_t robot = 0; robot < 14; robot++)
            scene.tell(790, robot, message(0x40, {static_cast<uint8_t>(habits_of(robot) & ~8)}));
        const auto outcome = outcome_of(scene.def, true, 1600, {1600});
        CHECK(outcome.statistics.medium.received > 200);
        check_all_ways(scene, 1600);
    }
}

TEST_CASE("under a lamp: run ahead, tick by tick, in chunks and by threads give the same") {
    for (uint64_t seed = 41; seed <= 43; seed++) {
        CAPTURE(seed);
        Scene scene(square_hall(4), seed);
        if (seed != 43) scene.def.kilobot_medium = infrared_settings();
        scene.def.light.sources = {{{0.5, 0.2}, 900, 0.5}};
        scene.def.step_ticks = seed == 42 ? 4 : 2;
        scene.add_anywhere("light_watcher", 6);
        check_all_ways(scene, 1500);
    }
}

TEST_CASE("callbacks that wait: run ahead, tick by tick, in chunks and by threads give the same, "
          "and soon") {
    for (uint64_t seed = 51; seed <= 52; seed++) {
        CAPTURE(seed);
        Scene scene(square_hall(1.2), seed);
        if (seed == 51) scene.def.kilobot_medium.emplace().range_m = 0.6;
        scene.add_anywhere("patient", 5);
        check_all_ways(scene, DURATION_TICKS);
    }
}

TEST_CASE("programs whose setup() waits, and commands meanwhile: all ways give the same") {
    for (uint64_t seed = 55; seed <= 57; seed++) {
        CAPTURE(seed);
        Scene scene(square_hall(0.8), seed);
        if (seed != 57) scene.def.kilobot_medium.emplace().range_m = 0.4;
        scene.def.step_ticks = seed == 56 ? 4 : 2;
        scene.add_anywhere("slow_start", 8);
        scene.add_anywhere("wanderer", 4);
        scene.tell(5, 1, message(WAKEUP));
        scene.tell(7, 1, run_message());
        scene.tell(6, 2, message(RESET));
        scene.tell(40, 2, run_message());
        scene.tell(44, 2, message(SLEEP));
        scene.tell(300, 2, message(WAKEUP));
        scene.tell(310, 2, run_message());
        scene.tell(8, 3, message(VOLTAGE));
        scene.tell(90, 3, run_message());
        check_all_ways(scene, 900);
    }
}

TEST_CASE("programs with delay(), waiting and failing ones among them: the same") {
    Scene scene(round_hall(5), 21);
    scene.def.floor = floor_settings();
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

TEST_CASE("the paper's firmware: run ahead, tick by tick, in chunks and by threads give the same") {
    for (uint64_t seed : {31, 32}) {
        CAPTURE(seed);
        Arena arena = round_hall(seed == 31 ? 6 : 12);
        double diameter = seed == 31 ? 2 : 3;
        arena.sites = {{Region::Shape::CIRCLE, {-1.5, 0}, {diameter, diameter}},
                       {Region::Shape::CIRCLE, {1.5, 0}, {diameter, diameter}}};
        if (seed == 32) arena.sites[1].centre.x() = 3;
        Scene scene(arena, seed);
        scene.def.floor = floor_settings();
        scene.add_anywhere("aggregation", 30);
        check_all_ways(scene, DURATION_TICKS);
    }
}

namespace {

/// Everything that can be known of a grid, beside its robots.
struct GridOutcome {
    Outcome robots;
    std::vector<std::tuple<Cycles, uint32_t, uint16_t, std::array<uint8_t, 8>>> frames;
    std::vector<std::tuple<Cycles, uint32_t, std::string>> events;
    std::vector<uint8_t> lights;
    std::vector<uint32_t> ticks;
    Grid::Counts counts;
};

/// The host configures and starts the modules, then polls one after the other, and changes the
/// configuration of a row now and then.
void host_speaks(Simulation &simulation, int64_t slot) {
    const auto &layout = simulation.grid().layout();
    auto send = [&](uint32_t bus, uint16_t id, std::vector<uint8_t> data) {
        CanFrame frame;
        frame.id = id;
        frame.dlc = static_cast<uint8_t>(data.size());
        std::copy(data.begin(), data.end(), frame.data.begin());
        simulation.send_can(bus, frame);
    };
    auto configure = [&](uint32_t bus, uint16_t id, uint8_t first) {
        send(bus, id, {0x0F, 0, 4, 0, 0, 0, 0, 0});
        send(bus, id,
             {0x10, 0, first, static_cast<uint8_t>(first + 1), static_cast<uint8_t>(first + 2), 7,
              0, 0});
        send(bus, id, {0x0D, 0, 0, 0, 0, 0, 0, 0});
    };
    for (uint32_t bus = 0; bus < layout.buses(); bus++)
        if (slot == 2)
            configure(bus, 0, 1);
        else if (slot > 4 && slot % 16 == 0)
            configure(bus, static_cast<uint16_t>((layout.first_row(bus) + 1) << 6),
                      static_cast<uint8_t>(slot));
    if (slot < 4) return;
    const auto module = static_cast<uint32_t>(slot * 7) % layout.modules();
    send(layout.bus(module),
         static_cast<uint16_t>((layout.y(module) + 1) << 6 | (layout.x(module) + 1) << 1), {0x15});
}

GridOutcome grid_outcome_of(SimulationDef def, bool run_ahead, int64_t duration_ticks,
                            const std::vector<int64_t> &chunks, uint32_t threads = 1) {
    constexpr int64_t HOST_EVERY = 24;
    def.run_ahead = run_ahead;
    def.threads = threads;
    def.sample_extras = {true, true, true};
    Simulation simulation(def);
    Grid &grid = simulation.grid();
    GridOutcome outcome;
    const int64_t begin = simulation.tick();
    size_t i = 0;
    for (int64_t slot = 0; simulation.tick() < duration_ticks; slot++) {
        host_speaks(simulation, slot);
        while (simulation.tick() < begin + (slot + 1) * HOST_EVERY) {
            simulation.advance(std::min(chunks[i++ % chunks.size()],
                                        begin + (slot + 1) * HOST_EVERY - simulation.tick()));
            note(outcome.robots, simulation);
            for (const auto &logged : grid.take_frames())
                outcome.frames.emplace_back(logged.at, logged.bus, logged.frame.id,
                                            logged.frame.data);
            for (const auto &event : grid.take_events(simulation.now()))
                outcome.events.emplace_back(event.at, event.robot, event.text);
        }
    }
    outcome.robots.hash = final_hash(simulation.snapshot());
    outcome.robots.statistics = simulation.statistics();
    for (uint32_t cell = 0; cell < grid.layout().cells(); cell++) {
        const CellLight light = grid.light(cell, simulation.now());
        outcome.lights.insert(outcome.lights.end(), light.rgb.begin(), light.rgb.end());
    }
    for (uint32_t module = 0; module < grid.layout().modules(); module++)
        outcome.ticks.push_back(grid.about(module, simulation.now()).ticks);
    outcome.counts = grid.counts;
    return outcome;
}

void check_same(const GridOutcome &a, const GridOutcome &b) {
    check_same(a.robots, b.robots);
    CHECK(a.frames.size() == b.frames.size());
    auto [one, other] =
        std::mismatch(a.frames.begin(), a.frames.end(), b.frames.begin(), b.frames.end());
    if (one != a.frames.end() && other != b.frames.end())
        CHECK(std::get<Cycles>(*one) == std::get<Cycles>(*other));
    CHECK(a.frames == b.frames);
    CHECK(a.events == b.events);
    CHECK(a.lights == b.lights);
    CHECK(a.ticks == b.ticks);
    CHECK(a.counts.sent == b.counts.sent);
    CHECK(a.counts.put_off == b.counts.put_off);
    CHECK(a.counts.received == b.counts.received);
    CHECK(a.counts.collided == b.counts.collided);
    CHECK(a.counts.deaf == b.counts.deaf);
    CHECK(a.counts.elsewhere == b.counts.elsewhere);
    CHECK(a.counts.lost == b.counts.lost);
}

}  // namespace

TEST_CASE("a grid: run ahead, module by module, in chunks and by threads give the same") {
    for (uint64_t seed = 41; seed <= 44; seed++) {
        CAPTURE(seed);
        Scene scene({{Region::Shape::RECTANGLE, {0, 0}, {0.8, 0.6}}, {}}, seed);
        scene.def.profile = small_robot();
        scene.def.profile.speed_m_s = 0.013;
        if (seed != 43) scene.def.kilobot_medium = infrared_settings();
        scene.def.range_m = 0.1;
        scene.def.clock_spread = 0.005;
        scene.def.step_ticks = seed == 42 ? 1 : seed == 44 ? 4 : 2;
        scene.def.sample_ticks = 101;
        auto grid = grid_settings(8, 6, 2);
        // The second one speaks whenever it likes.
        grid.program = guest(seed == 44 ? "module_alone" : "module_lab");
        grid.name = "module";
        grid.error_share = 0.02;
        grid.faults = {{200, Grid::Fault::Kind::RESET, 1, 1},
                       {300, Grid::Fault::Kind::DEAD, 5, 4},
                       {300, Grid::Fault::Kind::BUS_OFF, 6, 5},
                       {700, Grid::Fault::Kind::RECOVER, 5, 4},
                       {801, Grid::Fault::Kind::RECOVER, 6, 5}};
        scene.def.grid = grid;
        scene.def.lead_ticks = 96;
        scene.add_anywhere("wanderer", 6);
        const uint32_t puppet = scene.add_anywhere("puppet", 4);
        for (uint32_t robot = puppet; robot < puppet + 4; robot++) {
            scene.tell(0, robot, message(0x23, {1}));
            scene.tell(0, robot, message(0x22, {0x10, 0}));
        }
        scene.motors(10, puppet, 65, 65);
        constexpr int64_t TICKS = 1200;
        auto ahead = grid_outcome_of(scene.def, true, TICKS, {TICKS});
        CHECK(ahead.frames.size() > 100);
        CHECK(ahead.counts.received > 10);
        check_same(ahead, grid_outcome_of(scene.def, false, TICKS, {TICKS}));
        check_same(ahead, grid_outcome_of(scene.def, true, TICKS, {1, 7, 3, 100, 2, 33}));
        check_same(ahead, grid_outcome_of(scene.def, false, TICKS, {5, 64, 11}));
        check_same(ahead, grid_outcome_of(scene.def, true, TICKS, {1, 7, 3, 100, 2, 33}, TEAM));
    }
}

}  // namespace test_run_ahead
