#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <string_view>

#include "address.h"
#include "base/errors.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_grid {

namespace {

/// CAN types (hardware.md 3.2) and infrared types that the tests use.
enum : uint8_t {
    FORWARD = 0x01,
    STOP_FORWARDING = 0x02,
    IDLE = 0x0B,
    SETUP = 0x0C,
    RUN_PROGRAM = 0x0D,
    CONFIG_SIZE = 0x0F,
    CONFIG_TRANSFER = 0x10,
    TRACKING_RECORD = 0x11,
    TRACKING_START = 0x14,
    TRACKING_REQUEST = 0x15,

    CELL_STATE = 0x01,
    TRACKING = 0x10,
    DROP = 0x21,
};
constexpr int64_t LEAD = 128;

/// Kilobots with the program `puppet` on a grid whose modules run `module_lab`, received without
/// loss unless a test asks for it.
Scene on_grid(uint32_t columns, uint32_t rows, uint32_t buses, const std::vector<Pose> &poses,
              uint64_t seed = 1) {
    Scene scene({{Region::Shape::RECTANGLE, {0, 0}, {columns * MODULE_M, rows * MODULE_M}}, {}},
                seed);
    scene.def.profile = small_robot();
    auto exact = infrared_settings();
    exact.range_spread = exact.loss = exact.loss_at_range = exact.gain_noise_lsb = 0;
    scene.def.kilobot_medium = exact;
    auto grid = grid_settings(columns, rows, buses);
    grid.program = guest("module_lab");
    grid.name = "module_lab";
    grid.infrared.loss = grid.infrared.weak_share = 0;
    scene.def.grid = grid;
    scene.def.lead_ticks = LEAD;
    scene.add("puppet", poses);
    return scene;
}

/// The host's side, as raw frames.
class Host {
  public:
    explicit Host(Simulation &simulation) : simulation_(simulation) {}

    void send(uint32_t bus, kilogrid_address_t to, std::initializer_list<uint8_t> data) {
        CanFrame frame;
        frame.id = kilogrid_id(to);
        frame.dlc = static_cast<uint8_t>(data.size());
        std::copy(data.begin(), data.end(), frame.data.begin());
        REQUIRE(simulation_.send_can(bus, frame));
    }
    void send_all(std::initializer_list<uint8_t> data) {
        for (uint32_t bus = 0; bus < simulation_.grid().layout().buses(); bus++)
            send(bus, {0, 0, ADDR_BROADCAST}, data);
    }
    void poll(uint8_t x, uint8_t y) {
        const auto &layout = simulation_.grid().layout();
        send(layout.bus(layout.module(x, y)), {x, y, ADDR_INDIVIDUAL}, {TRACKING_REQUEST});
    }

    /// Each cell of each module gets its own state byte.
    void start(uint8_t a = 1, uint8_t b = 2, uint8_t c = 3, uint8_t d = 4) {
        simulation_.advance(60);  // the modules start up
        send_all({CONFIG_SIZE, 0, 4, 0, 0, 0, 0, 0});
        send_all({CONFIG_TRANSFER, 0, a, b, c, d, 0, 0});
        simulation_.advance(8);
        send_all({RUN_PROGRAM, 0, 0, 0, 0, 0, 0, 0});
        simulation_.advance(LEAD - 68);
    }

    /// Frames since the last call that modules sent.
    std::vector<Grid::LoggedFrame> answers() {
        auto frames = simulation_.grid().take_frames();
        std::erase_if(frames, [](const auto &logged) { return logged.from_host; });
        return frames;
    }

  private:
    Simulation &simulation_;
};

size_t count_type(const std::vector<Grid::LoggedFrame> &frames, uint8_t type) {
    return static_cast<size_t>(std::count_if(frames.begin(), frames.end(), [&](const auto &f) {
        return (f.frame.data[0] & 0x3F) == type;
    }));
}

/// Kilobots' puppet prints "type: data0 data1, gain mm"; how often it heard each cell's state.
std::map<int, int> states_heard(const Events &events, uint32_t robot) {
    std::map<int, int> heard;
    for (const auto &text : texts(events, robot)) {
        int type = 0, state = 0;
        if (std::sscanf(text.c_str(), "%d: %d", &type, &state) == 2 && type == CELL_STATE)
            heard[state]++;
    }
    return heard;
}

// Module (1, 1) of a grid of 3 x 3 is in the middle; its cells' middles are 2.5 cm off the origin.
constexpr double CELL_MIDDLE = CELL_M / 2;

}  // namespace

TEST_CASE("a robot in a cell's middle hears that cell twice a second, and no other") {
    auto scene = on_grid(3, 3, 1, {{{-CELL_MIDDLE, CELL_MIDDLE}, 0}});
    scene.tell(0, 0, message(SAY, {1}));
    Simulation simulation(scene.def);
    Host(simulation).start();
    simulation.take_events();
    constexpr double DURATION_S = 60;
    simulation.advance(static_cast<int64_t>(DURATION_S / TICK_S));
    auto heard = states_heard(simulation.take_events(), 0);
    CHECK(heard.size() == 1);
    // 1.907 a second; now and then two modules' cells, unheard here, make no difference.
    CHECK(heard[1] == doctest::Approx(DURATION_S / (16 * TICK_S)).epsilon(0.02));
}

TEST_CASE("a robot that crosses a cell at 1 cm/s hears it about ten times") {
    // Through the middle of a module's upper left cell, from well before it to well behind it.
    auto scene = on_grid(3, 3, 1, {{{-0.07, CELL_MIDDLE}, 0}});
    scene.tell(0, 0, message(SAY, {1}));
    scene.motors(0, 0, 65, 65);
    Simulation simulation(scene.def);
    Host(simulation).start(11, 22, 33, 44);
    simulation.advance(static_cast<int64_t>(10 / TICK_S));
    int within_borders = 0, within_range = 0;
    for (const auto &event : simulation.take_events()) {
        if (event.text.rfind("1: 11 ", 0) != 0) continue;
        const double x = -0.07 + 0.01 * simulation.seconds_of(event.at);
        within_range++;
        within_borders += x > -CELL_M && x < 0;
    }
    CHECK(std::abs(within_borders - 10) <= 1);
    // A way of 7.2 cm, a frame in 0.524 s.
    CHECK(std::abs(within_range - 14) <= 1);
}

TEST_CASE("a change of colour reaches the robots above within a repetition") {
    auto scene = on_grid(3, 3, 1, {{{-CELL_MIDDLE, CELL_MIDDLE}, 0}});
    scene.tell(0, 0, message(SAY, {1}));
    scene.def.kilobot_medium->loss = scene.def.kilobot_medium->loss_at_range = 0;
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    Grid &grid = simulation.grid();
    const uint32_t cell = GridLayout::MODULE_CELLS * grid.layout().module(1, 1);
    CHECK(grid.light(cell, simulation.now()).color() == 1);
    CHECK(grid.light(cell, simulation.now()).brightness() == 0xF0);
    for (uint8_t state : {5, 6, 7, 3, 2}) {
        CAPTURE(int{state});
        simulation.advance(37);
        simulation.take_events();
        const Cycles changed = simulation.now();
        host.send_all({CONFIG_SIZE, 0, 4, 0, 0, 0, 0, 0});
        host.send_all({CONFIG_TRANSFER, 0, state, 2, 3, 4, 0, 0});
        host.send_all({RUN_PROGRAM, 0, 0, 0, 0, 0, 0, 0});
        simulation.advance(64);
        CHECK(grid.light(cell, simulation.now()).color() == state);
        bool found = false;
        for (const auto &event : simulation.take_events()) {
            if (event.text.rfind("1: " + std::to_string(state) + " ", 0) != 0) continue;
            found = true;
            // Ten RUN messages come first, on each of the four cells.
            CHECK(seconds(event.at - changed) < 0.53 + 40 * 0.0045 + 0.1);
            break;
        }
        CHECK(found);
    }
}

TEST_CASE("robots hear RUN from the cells: they need no command of the experiment") {
    auto scene = on_grid(3, 3, 1, {{{0.03, 0.02}, 0}, {{-0.12, 0.07}, 1}});
    scene.def.commands.clear();
    for (uint32_t robot : {0u, 1u}) scene.tell(-100, robot, message(SEND, {TRACKING, 0}));
    Simulation simulation(scene.def);
    Host(simulation).start();
    simulation.advance(200);
    CHECK(simulation.statistics().medium.sent >= 20);
}

TEST_CASE("polled modules answer with what robots reported, others do not") {
    auto scene = on_grid(3, 3, 3, {{{CELL_MIDDLE, CELL_MIDDLE}, 0}});
    scene.tell(0, 0, message(SEND, {TRACKING, 0}));
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    simulation.advance(300);
    CHECK(host.answers().empty());
    host.poll(1, 1);
    host.poll(0, 0);
    simulation.advance(4);
    auto answers = host.answers();
    CHECK(count_type(answers, TRACKING_START) == 2);
    const size_t records = count_type(answers, TRACKING_RECORD);
    CHECK(records > 2);
    for (const auto &logged : answers) {
        kilogrid_address_t from;
        REQUIRE(kilogrid_address(logged.frame.id, &from));
        CHECK(from.type == ADDR_DISPATCHER);
        CHECK(logged.bus == from.y);  // three rows, three buses
        if ((logged.frame.data[0] & 0x3F) != TRACKING_RECORD) continue;
        CHECK(from.x == 1);
        CHECK(from.y == 1);
        CHECK(logged.frame.dlc == 8);
        CHECK(logged.frame.data[1] == 1);  // the robot's uid
    }
}

TEST_CASE("a module keeps ten records between two polls; the rest is lost silently") {
    auto scene = on_grid(1, 1, 1, {{{CELL_MIDDLE, CELL_MIDDLE}, 0}});
    scene.tell(0, 0, message(SEND, {TRACKING, 0}));
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    simulation.advance(3000);
    host.poll(0, 0);
    simulation.advance(4);
    auto answers = host.answers();
    CHECK(count_type(answers, TRACKING_RECORD) == 10);
    CHECK(count_type(answers, TRACKING_START) == 1);
    CHECK(simulation.grid().counts.received > 20);
    host.poll(0, 0);
    simulation.advance(2);
    CHECK(count_type(host.answers(), TRACKING_RECORD) <= 1);
}

TEST_CASE(
    "the receiver listens to one cell of four: a quarter of a still robot's frames are heard") {
    auto scene = on_grid(1, 1, 1, {{{CELL_MIDDLE, CELL_MIDDLE}, 0}});
    scene.def.grid->infrared.robot_range_m = 0.03;  // one cell only
    // Clocks that slide past one another, so that the receiver's turns are met by chance.
    scene.def.clock_spread = 0.01;
    uint64_t sent = 0, heard = 0;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        scene.def.seed = seed;
        Scene one = scene;
        one.tell(0, 0, message(SEND, {TRACKING, 0}));
        Simulation simulation(one.def);
        Host(simulation).start();
        simulation.advance(6000);
        sent += simulation.statistics().medium.sent;
        heard += simulation.grid().counts.received;
    }
    // 16 ticks are 51.2 turns of the receiver: neighbouring frames are not independent.
    CHECK(static_cast<double>(heard) / static_cast<double>(sent) ==
          doctest::Approx(0.25).epsilon(0.15));
}

TEST_CASE("two robots above one cell that cannot hear one another spoil each other's frames") {
    auto scene = on_grid(1, 1, 1, {{{0.005, CELL_MIDDLE}, 0}, {{0.045, CELL_MIDDLE}, 0}});
    scene.def.kilobot_medium->range_m = 0.02;
    scene.def.clock_spread = 0.01;
    for (uint32_t robot : {0u, 1u}) scene.tell(0, robot, message(SEND, {TRACKING, 0}));
    Simulation simulation(scene.def);
    Host(simulation).start();
    simulation.advance(20'000);
    CHECK(simulation.grid().counts.collided > 0);
    scene.def.kilobot_medium->collisions = false;
    Simulation lenient(scene.def);
    Host(lenient).start();
    lenient.advance(20'000);
    CHECK(lenient.grid().counts.collided == 0);
}

TEST_CASE("a dead module answers no poll, is dark, and the others go on") {
    auto scene = on_grid(3, 3, 1, {{{0, 0}, 0}});
    scene.def.grid->faults = {{50, Grid::Fault::Kind::DEAD, 1, 1}};
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    simulation.advance(40);
    host.poll(1, 1);
    simulation.advance(20);
    CHECK(count_type(host.answers(), TRACKING_START) == 1);
    const uint32_t module = simulation.grid().layout().module(1, 1);
    CHECK_FALSE(simulation.grid().lives(module));
    CHECK(simulation.grid().light(4 * module, simulation.now()).brightness() == 0);
    for (uint8_t y = 0; y < 3; y++)
        for (uint8_t x = 0; x < 3; x++) host.poll(x, y);
    simulation.advance(10);
    auto answers = host.answers();
    CHECK(count_type(answers, TRACKING_START) == 8);
    for (const auto &logged : answers)
        CHECK(logged.frame.id != kilogrid_id({1, 1, ADDR_DISPATCHER}));
}

TEST_CASE("a module that is reset in mid-run comes up idle, and can be set up again") {
    auto scene = on_grid(2, 2, 1, {{{-0.075, -0.025}, 0}});
    scene.tell(0, 0, message(SAY, {1}));
    scene.def.grid->faults = {{100, Grid::Fault::Kind::RESET, 0, 0}};
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    const uint32_t module = simulation.grid().layout().module(0, 0);
    simulation.advance(90);
    auto state = [&](uint32_t index) {
        return std::string_view(simulation.grid().about(index, simulation.now()).state);
    };
    CHECK(state(module) == "running");
    simulation.advance(110);
    CHECK(state(module) == "idle");
    CHECK(state(3) == "running");
    simulation.take_events();
    simulation.advance(100);
    CHECK(states_heard(simulation.take_events(), 0).empty());
    host.send(0, {0, 0, ADDR_INDIVIDUAL}, {CONFIG_SIZE, 0, 4, 0, 0, 0, 0, 0});
    host.send(0, {0, 0, ADDR_INDIVIDUAL}, {CONFIG_TRANSFER, 0, 9, 9, 9, 9, 0, 0});
    host.send(0, {0, 0, ADDR_INDIVIDUAL}, {RUN_PROGRAM, 0, 0, 0, 0, 0, 0, 0});
    simulation.advance(100);
    CHECK(states_heard(simulation.take_events(), 0)[9] >= 4);
}

TEST_CASE("a node that is bus-off hears and says nothing until it recovers") {
    auto scene = on_grid(2, 1, 1, {{{0, 0}, 0}});
    scene.def.grid->faults = {{10, Grid::Fault::Kind::BUS_OFF, 0, 0},
                              {110, Grid::Fault::Kind::RECOVER, 0, 0}};
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    simulation.advance(20);
    host.poll(0, 0);
    host.poll(1, 0);
    simulation.advance(20);
    CHECK(count_type(host.answers(), TRACKING_START) == 1);
    simulation.advance(100);
    host.poll(0, 0);
    simulation.advance(20);
    CHECK(count_type(host.answers(), TRACKING_START) == 1);
}

TEST_CASE("frames destroyed on the bus are sent again: at 5 % every poll is answered") {
    auto scene = on_grid(5, 4, 2, {{{0, 0}, 0}});
    scene.def.grid->error_share = 0.05;
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    size_t polls = 0, answered = 0;
    for (int sweep = 0; sweep < 20; sweep++) {
        for (uint8_t y = 0; y < 4; y++)
            for (uint8_t x = 0; x < 5; x++, polls++) host.poll(x, y);
        simulation.advance(10);
        answered += count_type(host.answers(), TRACKING_START);
    }
    CHECK(answered == polls);
    uint64_t errors = 0, lost = 0;
    for (uint32_t bus = 0; bus < 2; bus++) {
        const auto &counts = simulation.grid().bus(bus).counts();
        errors += counts.error_frames;
        lost += counts.lost_queue_full + counts.lost_bus_off + counts.lost_dead;
    }
    CHECK(errors > polls / 20);
    CHECK(lost == 0);
}

TEST_CASE("a bus reaches its own rows only") {
    auto scene = on_grid(2, 4, 2, {{{0, 0}, 0}});
    Simulation simulation(scene.def);
    Host host(simulation);
    simulation.advance(60);
    host.send(1, {0, 0, ADDR_BROADCAST}, {SETUP, 0, 0, 0, 0, 0, 0, 0});
    simulation.advance(4);
    host.send(1, {0, 0, ADDR_BROADCAST}, {RUN_PROGRAM, 0, 0, 0, 0, 0, 0, 0});
    simulation.advance(30);
    for (uint32_t module = 0; module < 8; module++) {
        CAPTURE(module);
        CHECK(std::string_view(simulation.grid().about(module, simulation.now()).state) ==
              (module < 4 ? "idle" : "running"));
    }
    CHECK_THROWS_AS(simulation.send_can(2, {}), EngineError);
}

TEST_CASE("with the ideal medium every robot in a cell hears every frame, and is heard") {
    auto scene = on_grid(3, 3, 1, {{{CELL_MIDDLE, CELL_MIDDLE}, 0}, {{0.04, 0.03}, 0}});
    scene.def.kilobot_medium.reset();
    scene.def.range_m = 0.1;
    for (uint32_t robot : {0u, 1u}) scene.tell(0, robot, message(SAY, {1}));
    scene.tell(0, 0, message(SEND, {TRACKING, 0}));
    Simulation simulation(scene.def);
    Host host(simulation);
    host.start();
    simulation.take_events();
    simulation.advance(16 * 20);
    auto events = simulation.take_events();
    for (uint32_t robot : {0u, 1u}) CHECK(std::abs(states_heard(events, robot)[2] - 20) <= 1);
    host.poll(1, 1);
    simulation.advance(4);
    CHECK(count_type(host.answers(), TRACKING_RECORD) == 10);
}

TEST_CASE("before t = 0 the host has the engine to itself for the lead") {
    auto scene = on_grid(1, 1, 1, {{{0, 0}, 0}});
    scene.def.sample_ticks = 16;
    Simulation simulation(scene.def);
    CHECK(simulation.tick() == -LEAD);
    simulation.advance(60);
    CHECK(simulation.tick() == 60 - LEAD);
    Host(simulation).send_all({SETUP, 0, 0, 0, 0, 0, 0, 0});
    simulation.advance(LEAD - 60);
    CHECK(simulation.tick() == 0);
    auto frames = simulation.grid().take_frames();
    REQUIRE(frames.size() == 1);
    CHECK(simulation.seconds_of(frames[0].at) < -68 * TICK_S + 0.001);
    CHECK(simulation.take_samples().tick == std::vector<int64_t>{0});
}

TEST_CASE("a grid that cannot be, and frames without a grid, are refused") {
    auto scene = on_grid(1, 1, 1, {{{0, 0}, 0}});
    scene.def.grid->faults = {{0, Grid::Fault::Kind::DEAD, 1, 0}};
    CHECK_THROWS_AS(Simulation(scene.def), EngineError);
    scene.def.grid->faults.clear();
    scene.def.grid->program = guest("puppet");  // a robot's
    CHECK_THROWS_AS(Simulation(scene.def), EngineError);
    scene.def.grid.reset();
    Simulation simulation(scene.def);
    CHECK_THROWS_AS(simulation.send_can(0, {}), EngineError);
}

}  // namespace test_grid
