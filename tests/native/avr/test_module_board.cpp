// A Kilogrid's module from its hex: sites, linked with our runtime, on an ATmega328P with its
// chips.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "avr/boards/module_board.h"
#include "base/message_crc.h"
#include "infrared/infrared_pulses.h"

using namespace kilotwin;

namespace test_module_board {

namespace {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
enum : uint8_t {
    IDLE = 0x0B,
    RUN = 0x0D,
    CONFIG_SIZE = 0x0F,
    CONFIG = 0x10,
    TRACKING_START = 0x14,
    POLL = 0x15,
    ASK = 0x19,
    REPORTED = 0x1A
};
constexpr uint8_t X = 3, Y = 7;
constexpr uint16_t OWN = (Y + 1) << 6 | (X + 1) << 1, ROW = (Y + 1) << 6, TO_HOST = OWN | 1;
constexpr uint8_t TRACKING = 0x10;

struct Bench {
    /// Its frames go out 300 us later, as on a bus that is free.
    void run_ms(double ms) {
        const Cycles until = board.now() + static_cast<Cycles>(ms * double(MS));
        while (board.now() < until) {
            board.run(board.now() + MS / 4);
            for (const auto &output : std::exchange(board.can_frames, {})) {
                sent.push_back(output);
                board.frame_sent(std::max(output.at + MS * 3 / 10, board.now()));
            }
        }
    }
    void tell(uint16_t id, std::initializer_list<uint8_t> data) {
        CanFrame frame;
        frame.id = id;
        frame.dlc = static_cast<uint8_t>(data.size());
        std::copy(data.begin(), data.end(), frame.data.begin());
        board.receive_can(board.now(), frame);
        run_ms(1);
    }
    void start(uint8_t a, uint8_t b, uint8_t c, uint8_t d) {
        run_ms(1500);
        tell(0, {CONFIG_SIZE, 0, 4, 0, 0, 0, 0, 0});
        tell(ROW, {CONFIG, 0, a, b, c, d, 0, 0});
        run_ms(10);
        tell(OWN, {RUN, 0, 0, 0, 0, 0, 0, 0});
        run_ms(400);
    }
    void shine(uint8_t cell, const message_t &message) {
        for (Cycles offset : pulses_of(message)) {
            const Cycles at = board.now() + 100 + offset;
            board.shine(cell, {at, at + 40, {250, 700}});
        }
    }

    Chance chance{1};
    std::shared_ptr<const FlashImage> image = FlashImage::load(MODULES "/sites.elf");
    ModuleBoard board{*image, 5, ModuleBoard::eeprom_of(X, Y), TICK_CYCLES, 0, chance};
    std::vector<CanOutput> sent;
};

/// The messages that a cell sent.
std::vector<message_t> said_by(const std::vector<ModuleBoard::Light> &lights, uint8_t cell) {
    std::vector<message_t> messages;
    PulseReader reader;
    for (const auto &light : lights)
        if (light.on && light.cell == cell && reader.pulse(light.at) == PulseReader::Found::MESSAGE)
            messages.push_back(reader.message());
    return messages;
}

}  // namespace

TEST_CASE("a module shows its lights, then breathes, and has found its CAN controller") {
    Bench bench;
    bench.run_ms(75);
    CHECK(bench.board.light(0).color() == 1);
    CHECK(bench.board.light(1).color() == 1);
    CHECK(bench.board.light(3).color() == 0);
    bench.run_ms(3000);
    CHECK(bench.board.failure() == "");
    CHECK(bench.board.light(2).color() == 7);
    CHECK(bench.board.light(2).brightness() <= 20);
    // Not the red of a module without a controller.
    const uint8_t before = bench.board.light(0).brightness();
    bench.run_ms(700);
    CHECK(bench.board.light(0).brightness() != before);
}

TEST_CASE("a module takes what is for it, and lets other modules' frames pass") {
    Bench bench;
    bench.run_ms(1500);
    const CellLight idle = bench.board.light(0);
    bench.tell(OWN + 2, {CONFIG_SIZE, 0, 4, 0, 0, 0, 0, 0});
    bench.tell(TO_HOST, {CONFIG_SIZE, 0, 4, 0, 0, 0, 0, 0});
    bench.run_ms(200);
    CHECK(bench.board.light(0).color() == idle.color());
    bench.tell(OWN, {POLL});
    bench.run_ms(100);
    REQUIRE(bench.sent.size() == 1);
    CHECK(bench.sent[0].frame.id == TO_HOST);
    CHECK(bench.sent[0].frame.dlc == 2);
    CHECK(bench.sent[0].frame.data[0] == TRACKING_START);
    CHECK(bench.sent[0].frame.data[1] == 0);
}

TEST_CASE("each running cell repeats its message each 524 ms, by its own LED") {
    Bench bench;
    bench.start(1, 2, 3, 4);
    bench.run_ms(200);
    bench.board.lights.clear();
    bench.run_ms(5240);
    for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++) {
        CAPTURE(int(cell));
        const auto said = said_by(bench.board.lights, cell);
        CHECK(std::abs(int(said.size()) - 10) <= 1);
        REQUIRE_FALSE(said.empty());
        CHECK(crc_is_right(said[0]));
        CHECK(said[0].type == 1);
    }
    // Different codes show in different lights.
    CHECK(bench.board.light(0).rgb != bench.board.light(3).rgb);
}

TEST_CASE("a robot's report that a listening cell hears goes to the host with the next poll") {
    Bench bench;
    bench.start(2, 2, 2, 2);
    message_t report = {};
    report.type = static_cast<decltype(report.type)>(TRACKING);
    for (uint8_t i = 0; i < 7; i++) report.data[i] = static_cast<uint8_t>(11 + i);
    report.crc = crc_of(report);
    // The receiver goes from cell to cell each 10 ms, so one of many tries is heard.
    for (int i = 0; i < 12 && bench.sent.size() < 2; i++) {
        bench.shine(2, report);
        bench.run_ms(23);
        bench.sent.clear();
        bench.tell(OWN, {POLL});
        bench.run_ms(20);
    }
    REQUIRE(bench.sent.size() >= 2);
    CHECK(bench.sent[0].frame.data[1] == bench.sent.size() - 1);
    const CanFrame &record = bench.sent[1].frame;
    CHECK(record.id == TO_HOST);
    CHECK(record.data[0] == (0x11 | 2 << 6));
    for (uint8_t i = 0; i < 7; i++) CHECK(record.data[1 + i] == 11 + i);
}

TEST_CASE("a question of the host goes out once by each cell") {
    Bench bench;
    bench.run_ms(1500);
    for (uint8_t time = 1; time < 3; time++) {
        bench.board.lights.clear();
        bench.tell(OWN, {ASK, 0xE1, 4, time, 0xFF, 0xFF});
        bench.run_ms(30);
        for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++) {
            const auto said = said_by(bench.board.lights, cell);
            REQUIRE(said.size() == 1);
            CHECK(crc_is_right(said[0]));
            CHECK(said[0].type == 0x8C);
            const std::array<uint8_t, 9> data = {0xE1, 4, time, 0xFF, 0xFF, 0, 0, 0, 0};
            CHECK(std::equal(data.begin(), data.end(), said[0].data));
        }
    }
    bench.start(1, 1, 1, 1);
    bench.board.lights.clear();
    bench.tell(OWN, {ASK, 0xE1, 4, 9, 0xFF, 0xFF});
    bench.run_ms(600);
    for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++)
        for (const auto &said : said_by(bench.board.lights, cell)) CHECK(said.type != 0x8C);
}

TEST_CASE("a robot's answer goes to the host without a poll, idle and running") {
    message_t answer = {{0x34, 0x12, 0xE1, 1, 2, 3, 4, 0x12, 9}, 0x8D, 0};
    answer.crc = crc_of(answer);
    for (bool runs : {false, true}) {
        CAPTURE(runs);
        Bench bench;
        if (runs)
            bench.start(2, 2, 2, 2);
        else
            bench.run_ms(1500);
        for (int i = 0; i < 20 && bench.sent.empty(); i++) {
            bench.shine(3, answer);
            bench.run_ms(23);
        }
        REQUIRE(bench.sent.size() == 1);
        const CanFrame &frame = bench.sent[0].frame;
        CHECK(frame.id == TO_HOST);
        CHECK(frame.dlc == 8);
        CHECK(frame.data ==
              std::array<uint8_t, 8>{REPORTED | 3 << 6, 0x34, 0x12, 1, 2, 3, 4, 0x12});
        bench.sent.clear();
        bench.tell(OWN, {POLL});
        bench.run_ms(100);
        REQUIRE(bench.sent.size() == 1);  // no record of the program
        CHECK(bench.sent[0].frame.data[1] == 0);
    }
}

TEST_CASE("a program for robots goes out with what it is checked by") {
    Bench bench;
    bench.run_ms(1500);
    // The emulated chip reads a frame in 1.7 ms.
    auto tell = [&bench](std::initializer_list<uint8_t> data) {
        bench.tell(OWN, data);
        bench.run_ms(2);
    };
    tell({0x04, 1, 0x34, 0x12, 0xEF, 0xBE, 0xAD, 0xDE});
    tell({0x04, 0, 9, 0, 0, 0, 0, 0});
    tell({0x05, 0, 7, 0, 0, 0, 0, 0});
    bench.board.lights.clear();
    for (uint8_t part = 0; part < 22; part++) tell({0x03, part, part, 0, 0, 0, 0, 0});
    bench.run_ms(150);
    const auto said = said_by(bench.board.lights, 0);
    REQUIRE(said.size() == 23);
    const std::array<uint8_t, 9> data = {9, 'K', 'T', 0x34, 0x12, 0xEF, 0xBE, 0xAD, 0xDE};
    CHECK(said[0].type == 0x82);
    CHECK(std::equal(data.begin(), data.end(), said[0].data));
    CHECK(said[22].data[0] == 7);
}

TEST_CASE("frames that come while the module sends light are kept by its controller") {
    Bench bench;
    bench.start(1, 1, 1, 1);
    for (int i = 0; i < 200; i++) {
        bench.tell(OWN, {POLL});
        bench.run_ms(8.3);
    }
    CHECK(bench.sent.size() == 200);
    CHECK(bench.board.frames_missed() == 0);
}

TEST_CASE("the host's commands set a module running and idle") {
    Bench bench;
    bench.start(1, 1, 1, 1);
    const auto state = bench.image->symbol("runtime_orders");  // begins with the state
    REQUIRE(state);
    CHECK(bench.board.read(*state) == 7);
    bench.tell(OWN, {IDLE, 0, 0, 0, 0, 0, 0, 0});
    bench.run_ms(100);
    CHECK(bench.board.read(*state) == 1);
}

// Robots on chips shine from one quantum to the next: a pulse that the board is past is lost.
TEST_CASE("a module's board stops where it is told while its program writes the lights") {
    constexpr Cycles QUANTUM = 1024, INSTRUCTION = 8;
    Bench bench;
    Cycles latest = 0;
    for (Cycles told = QUANTUM; told < 1000 * MS; told += QUANTUM) {
        bench.board.run(told);
        latest = std::max(latest, std::max(told, bench.board.now()) - told);
    }
    CHECK(latest <= INSTRUCTION);
}

TEST_CASE("a module's reset by its watchdog is handed out with its time and cause") {
    const Chance chance{1};
    const auto image = FlashImage::load(PROGRAMS "/sleeper.hex");
    ModuleBoard board{*image, 5, ModuleBoard::eeprom_of(X, Y), TICK_CYCLES, 0, chance};
    board.run(4000 * MS);
    REQUIRE(board.resets.size() == 1);
    CHECK(board.resets[0].at / MS / 100 == 30);
    CHECK(board.resets[0].reset.text().starts_with("its watchdog reset it: not fed for 1024 ms"));
}

}  // namespace test_module_board
