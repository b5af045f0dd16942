#include "base/errors.h"
#include "base/message_crc.h"
#include "module_bench.h"
#include "runtime/core/eeprom_map.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_module {

TEST_CASE("a module shows its lights when switched on, then breathes white") {
    ModuleBench bench("module_lab", 2 * SECOND);
    bench.run(2 * SECOND + 60 * MS);
    CHECK(bench.module.state() == Module::State::INIT);
    CHECK(bench.module.light(1, bench.now).color() == 1);  // red comes first, cell by cell
    CHECK(bench.module.light(2, bench.now).color() == 0);
    bench.run(2 * SECOND + 5 * 50 * MS + MS);
    CHECK(bench.module.light(1, bench.now).color() == 0);
    CHECK(bench.module.light(3, bench.now).color() == 1);
    bench.run(2 * SECOND + 1200 * MS + MS);
    CHECK(bench.module.state() == Module::State::IDLE);
    const Cycles began = 2 * SECOND + 1200 * MS;
    for (int step : {0, 1, 19, 20, 21, 39, 40, 41}) {
        bench.run(began + static_cast<Cycles>(step) * 70 * MS + MS);
        const CellLight light = bench.module.light(0, bench.now);
        const int bright = step % 40 <= 20 ? step % 40 : 40 - step % 40;
        CHECK(light.brightness() == bright);
        CHECK(light.color() == (bright > 0 ? 7 : 0));
    }
    CHECK(bench.sent.empty());
    CHECK(bench.frames.empty());
    CHECK(bench.module.next_event() == NEVER);
}

TEST_CASE("a module listens to broadcasts, its row, its column and its own address") {
    ModuleBench bench("module_lab");
    const auto ids = bench.module.filters();
    CHECK(ids[0] == 0x000);
    CHECK(ids[1] == (Y + 1) << 6);
    CHECK(ids[2] == (X + 1) << 1);
    CHECK(ids[3] == ((Y + 1) << 6 | (X + 1) << 1));
}

TEST_CASE("a module that is configured runs setup, and loop only after RUN") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    bench.configure({1, 2, 4, 15});
    CHECK(bench.module.state() == Module::State::SETUP);
    bench.run_for(SECOND);
    CHECK(bench.sent.empty());
    bench.tell({GO_RUN});
    CHECK(bench.module.state() == Module::State::RUNNING);
    bench.run_for(2 * SECOND);
    CHECK(bench.module.light(0, bench.now).rgb == std::array<uint8_t, 3>{0xF0, 0, 0});
    CHECK(bench.module.light(1, bench.now).rgb == std::array<uint8_t, 3>{0, 0xF0, 0});
    CHECK(bench.module.light(2, bench.now).rgb == std::array<uint8_t, 3>{0, 0, 0xF0});
    CHECK(bench.module.light(3, bench.now).rgb == std::array<uint8_t, 3>{10, 10, 10});
    const auto said = bench.sent_by(3).back().message;
    CHECK(said.type == CELL_STATE);
    CHECK(std::vector<uint8_t>(said.data, said.data + 5) == std::vector<uint8_t>{15, 0, X, Y, 1});
    CHECK(crc_is_right(said));
}

TEST_CASE("a module that starts to run first sends RUN ten times on each cell") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    bench.configure({1, 2, 3, 4});
    bench.tell({GO_RUN});
    bench.run_for(200 * MS);
    REQUIRE(bench.sent.size() >= 40);
    for (size_t i = 0; i < 40; i++) {
        CHECK(bench.sent[i].message.type == RUN);
        CHECK(bench.sent[i].cell == i % 4);
        CHECK(crc_is_right(bench.sent[i].message));
        if (i > 0) CHECK(bench.sent[i].at - bench.sent[i - 1].at == FRAME_CYCLES);
    }
    CHECK(bench.module.light(2, bench.sent[20].at).color() != 0);
    bench.run_for(5 * SECOND);
    for (size_t i = 40; i < bench.sent.size(); i++) CHECK(bench.sent[i].message.type == CELL_STATE);
}

TEST_CASE("each cell repeats its message every 16 ticks, the cells four ticks apart") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.run_for(10 * SECOND);
    REQUIRE(bench.sent.size() > 70);
    for (size_t i = 1; i < bench.sent.size(); i++) {
        CHECK(bench.sent[i].cell == (bench.sent[i - 1].cell + 1) % 4);
        CHECK(bench.sent[i].at - bench.sent[i - 1].at == 4 * TICK_CYCLES);
    }
}

TEST_CASE("a cell that finds the channel busy waits for its next turn") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    std::vector<CellEmission> asked;
    bench.channel = [&](const CellEmission &what) {
        asked.push_back(what);
        return what.cell == 2 ? Module::Answer::BUSY : Module::Answer::SENT;
    };
    const uint32_t ticks_before = bench.module.ticks();
    bench.run_for(20 * SECOND);
    size_t failed = 0;
    for (size_t i = 1; i < asked.size(); i++) {
        CHECK(asked[i].cell == (asked[i - 1].cell + 1) % 4);
        const Cycles gap = asked[i].at - asked[i - 1].at;
        if (asked[i - 1].cell == 2) {  // the next tick came soon, and counted for less
            failed++;
            CHECK(gap > 3 * TICK_CYCLES);
            CHECK(gap < 5 * TICK_CYCLES);
        } else {
            CHECK(gap == 4 * TICK_CYCLES);
        }
    }
    CHECK(bench.sent_by(2).empty());
    CHECK(bench.module.ticks() - ticks_before > 20 * SECOND / TICK_CYCLES + failed / 4);
}

TEST_CASE("a module that is receiving tries again at the next tick") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.run_for(3 * SECOND);
    int refusals = 3;
    std::vector<CellEmission> asked;
    bench.channel = [&](const CellEmission &what) {
        asked.push_back(what);
        return refusals-- > 0 ? Module::Answer::RECEIVING : Module::Answer::SENT;
    };
    bench.run_for(SECOND);
    REQUIRE(asked.size() > 5);
    for (size_t i = 1; i <= 3; i++) {
        CHECK(asked[i].cell == asked[0].cell);
        CHECK(asked[i].at - asked[i - 1].at == TICK_CYCLES);
    }
    CHECK(asked[4].cell == (asked[0].cell + 1) % 4);
}

TEST_CASE("a forwarded message is repeated on all cells until STOP") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    bench.tell({FORWARD, 0, 1, 2, 3, 4, 5, 6});
    CHECK(bench.module.state() == Module::State::IDLE);
    bench.tell({FORWARD, 1, 7, 8, 9, VOLTAGE});
    CHECK(bench.module.state() == Module::State::SETUP_KILOBOTS);
    bench.run_for(SECOND);
    CHECK(bench.sent.size() > 200);  // four frames of 4.4 ms and the lights
    for (size_t i = 0; i < bench.sent.size(); i++) {
        CHECK(bench.sent[i].cell == i % 4);
        CHECK(bench.sent[i].message.type == VOLTAGE);
        CHECK(bench.sent[i].message.data[8] == 9);
        CHECK(crc_is_right(bench.sent[i].message));
    }
    CHECK(bench.module.light(1, bench.now).color() == 3);
    bench.tell({STOP});
    bench.run_for(30 * MS);  // the round that was under way ends
    bench.sent.clear();
    bench.run_for(SECOND);
    CHECK(bench.sent.empty());
    CHECK(bench.module.state() == Module::State::IDLE);
}

TEST_CASE("the lights say which command is being forwarded") {
    const std::pair<uint8_t, uint8_t> cases[] = {{RESET, 2}, {BOOT, 4},   {SLEEP, 7},  {RUN, 5},
                                                 {CALIB, 3}, {CHARGE, 1}, {WAKEUP, 0}, {0x7D, 3},
                                                 {0x03, 0},  {VOLTAGE, 3}};
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    for (auto [type, color] : cases) {
        bench.tell({FORWARD, 0});
        bench.tell({FORWARD, 1, 0, 0, 0, type});
        bench.run_for(60 * MS);
        CHECK(bench.module.light(0, bench.now).color() == color);
    }
}

TEST_CASE("modules outside the calibration area do not forward CALIB") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    const uint16_t bounds[] = {EEPROM_CALIB_X_MIN, EEPROM_CALIB_X_MAX, EEPROM_CALIB_Y_MIN,
                               EEPROM_CALIB_Y_MAX};
    const uint8_t values[] = {X + 1, X + 2, Y, Y};
    for (size_t i = 0; i < 4; i++) bench.module.set_eeprom(bounds[i], values[i]);
    bench.module.set_eeprom(EEPROM_CALIB_RESTRICTED, 1);
    bench.tell({FORWARD, 0});
    bench.tell({FORWARD, 1, 0, 0, 0, CALIB});
    bench.run_for(SECOND);
    CHECK(bench.sent.empty());
    bench.module.set_eeprom(EEPROM_CALIB_X_MIN, X);
    bench.tell({FORWARD, 0});
    bench.tell({FORWARD, 1, 0, 0, 0, CALIB});
    bench.run_for(SECOND);
    CHECK(!bench.sent.empty());
}

TEST_CASE("what robots report waits for the poll, ten records at most") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    for (uint8_t i = 0; i < 13; i++) bench.hear(i % 4, tracking({i, 1, 2, 3, 4, 5, 6, 77}));
    bench.hear(0, tracking({99}), true);  // wrong checksum
    CHECK(bench.frames.empty());
    bench.tell(frame({POLL}, 1));
    bench.run_for(50 * MS);
    REQUIRE(bench.frames.size() == 11);
    for (const auto &output : bench.frames)
        CHECK(output.frame.id == ((Y + 1) << 6 | (X + 1) << 1 | 1));
    CHECK(bench.frames[0].frame.dlc == 2);
    CHECK(bench.frames[0].frame.data[0] == TRACKED_START);
    CHECK(bench.frames[0].frame.data[1] == 10);
    for (uint8_t i = 0; i < 10; i++) {
        const CanFrame &record = bench.frames[i + 1u].frame;
        CHECK(record.dlc == 8);
        CHECK(record.data ==
              std::array<uint8_t, 8>{uint8_t(TRACKED | (i % 4) << 6), i, 1, 2, 3, 4, 5, 6});
    }
    CHECK(bench.frames[1].at - bench.frames[0].at == MS);
    bench.frames.clear();
    bench.tell(frame({POLL}, 1));
    bench.run_for(50 * MS);
    REQUIRE(bench.frames.size() == 1);
    CHECK(bench.frames[0].frame.data[1] == 0);
}

TEST_CASE("an idle module answers a poll when its main loop comes round") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    bench.run_for(23 * MS);
    const Cycles asked = bench.now;
    bench.module.receive_can(asked, frame({POLL}, 1));
    CHECK(bench.module.next_event() == asked);
    bench.run_for(100 * MS);
    REQUIRE(bench.frames.size() == 1);
    CHECK(bench.frames[0].at > asked);
    CHECK((bench.frames[0].at - 1200 * MS) % (70 * MS) == 0);
}

TEST_CASE("a robot's page goes out through one cell, and the next lap through the next") {
    ModuleBench bench("module_lab");
    bench.run(AWAKE);
    bench.tell({FORWARD, 0});
    bench.tell({FORWARD, 1, 0, 0, 0, BOOT});
    bench.run_for(100 * MS);
    bench.tell({STOP});
    bench.run_for(50 * MS);
    bench.sent.clear();
    bench.tell({PAGES, 0, 2});
    for (uint8_t lap = 0; lap < 5; lap++) {
        for (uint8_t page = 0; page < 2; page++) {
            bench.tell({PAGE_NUMBER, 0, page});
            bench.run_for(9 * MS);
            CHECK(bench.module.state() == Module::State::WAITING_FOR_PAGE);
            for (uint8_t part = 0; part < 22; part++) {
                CanFrame chunk = frame({PAGE, part});
                for (uint8_t i = 0; i < 6; i++)
                    chunk.data[2u + i] = static_cast<uint8_t>(part * 6 + i + page);
                bench.tell(chunk);
            }
            CHECK(bench.module.state() == Module::State::BOOTLOADING_KILOBOTS);
            bench.run_for(110 * MS);
            const size_t frames = page == 0 ? 23 : 22;
            REQUIRE(bench.sent.size() == frames);
            if (page == 0) {
                CHECK(bench.sent[0].message.type == BOOTPGM_SIZE);
                CHECK(bench.sent[0].message.data[0] == 2);
            }
            for (uint8_t part = 0; part < 22; part++) {
                const auto &emission = bench.sent[frames - 22 + part];
                CHECK(emission.cell == lap % 4);
                CHECK(emission.message.type == BOOTPGM_PAGE);
                CHECK(emission.message.data[0] == page);
                CHECK(emission.message.data[1] == part * 3);
                CHECK(emission.message.data[2] == static_cast<uint8_t>(part * 6 + page));
                CHECK(emission.message.data[7] ==
                      (part < 21 ? static_cast<uint8_t>(part * 6 + 5 + page) : 0));
                CHECK(crc_is_right(emission.message));
                if (part == 0) continue;
                const Cycles before = bench.sent[frames - 23 + part].at;
                CHECK(emission.at == before + FRAME_CYCLES + BURST_GAP_CYCLES);
            }
            if (page == 0) CHECK(bench.module.light(lap % 4, bench.now).color() == 4);
            bench.sent.clear();
        }
    }
}

TEST_CASE("a module tells its health when asked, part by part") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4, 5});
    for (uint8_t i = 0; i < 12; i++) bench.hear(0, tracking({i}));
    bench.tell({CONFIG_SIZE, 0, 49});
    bench.module.set_can_errors(8, 9);
    bench.run(20 * SECOND + AWAKE);
    bench.tell(frame({HEALTH, 0}, 2));
    bench.tell(frame({HEALTH, 1}, 2));
    bench.tell(frame({HEALTH, 2}, 2));
    REQUIRE(bench.frames.size() == 2);
    const auto first = bench.frames[0].frame, second = bench.frames[1].frame;
    const uint8_t bytes[] = {1, 2, 3, 4, 5};
    const uint16_t crc = crc_of(bytes, sizeof bytes);
    CHECK(first.data == std::array<uint8_t, 8>{HEALTH, 0, 7, 5, static_cast<uint8_t>(crc),
                                               static_cast<uint8_t>(crc >> 8), 2, 1});
    CHECK(second.data[2] == 8);
    CHECK(second.data[3] == 9);
    CHECK((second.data[4] | second.data[5] << 8) == 21);
    CHECK(second.data[6] == 1);
    CHECK(bench.module.counts().frames_refused == 2);
}

TEST_CASE("frames that no one should send change nothing, and are counted") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    const auto before = bench.module.state();
    CanFrame remote = frame({GO_IDLE});
    remote.rtr = true;
    const CanFrame bad[] = {frame({}, 0),
                            remote,
                            frame({CONFIG_SIZE, 0, 0}),
                            frame({CONFIG_SIZE, 0, 49}),
                            frame({CONFIG_SIZE, 0}, 2),
                            frame({CONFIG, 0, 9, 9, 9, 9, 9, 9}),
                            frame({FORWARD, 1, 0, 0, 0, RESET}),
                            frame({FORWARD, 2}),
                            frame({PAGES, 0, 221}),
                            frame({PAGE_NUMBER, 0, 5}),
                            frame({PAGE, 3})};
    for (const auto &what : bad) bench.tell(what);
    CHECK(bench.module.state() == before);
    CHECK(bench.module.counts().frames_refused == std::size(bad));
    bench.tell({PAUSE});
    CHECK(bench.module.state() == before);
    bench.sent.clear();
    bench.run_for(2 * SECOND);
    CHECK(bench.sent_by(0).back().message.data[0] == 1);
}

TEST_CASE("a configuration whose parts come out of order is dropped until it is sent again") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.tell({CONFIG_SIZE, 0, 8});
    CHECK(bench.module.state() == Module::State::WAITING_FOR_CONFIGURATION);
    bench.tell({CONFIG, 1, 7, 7});
    bench.tell({CONFIG, 0, 7, 7, 7, 7, 7, 7});
    CHECK(bench.module.state() == Module::State::WAITING_FOR_CONFIGURATION);
    bench.configure({7, 7, 7, 7, 7, 7, 7, 7});
    CHECK(bench.module.state() == Module::State::SETUP);
}

TEST_CASE("a module that is configured anew while it runs sets up and waits for RUN") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.hear(0, tracking({1}));
    bench.configure({4, 3, 2, 1});
    CHECK(bench.module.state() == Module::State::SETUP);
    bench.run_for(SECOND);
    CHECK(bench.sent_by(0).back().message.data[0] == 1);  // the cells go on saying what they said
    bench.sent.clear();
    bench.tell({GO_RUN});
    bench.run_for(2 * SECOND);
    CHECK(bench.sent[0].message.type == RUN);
    CHECK(bench.sent_by(0).back().message.data[0] == 4);
    CHECK(bench.sent_by(0).back().message.data[4] == 2);
    bench.tell(frame({POLL}, 1));
    CHECK(bench.frames.back().frame.data[1] == 0);  // records from before RUN are thrown away
}

TEST_CASE("SETUP runs setup only if it has not run since the configuration") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.tell({GO_SETUP});
    bench.tell({GO_RUN});
    bench.run_for(2 * SECOND);
    CHECK(bench.sent_by(0).back().message.data[4] == 1);
    ModuleBench fresh("module_lab");
    fresh.run(AWAKE);
    fresh.tell({GO_SETUP});
    fresh.tell({GO_RUN});
    fresh.run_for(2 * SECOND);
    CHECK(fresh.sent_by(0).back().message.data[4] == 1);
}

TEST_CASE("what robots drop on a cell adds up there and evaporates") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    for (int i = 0; i < 3; i++) bench.hear(2, message(DROP));
    bench.run_for(1500 * MS);
    CHECK(bench.sent_by(2).back().message.data[1] == 3);
    CHECK(bench.sent_by(1).back().message.data[1] == 0);
    bench.run_for(20 * SECOND);
    CHECK(bench.sent_by(2).back().message.data[1] == 0);
}

TEST_CASE("while a module sends, its controller keeps two frames") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    while (!bench.module.asks()) bench.module.run(bench.now += MS);
    const Cycles asked = bench.module.outgoing().at;
    bench.module.answer(Module::Answer::SENT);
    for (uint8_t i = 0; i < 4; i++)
        bench.module.receive_can(asked + (i + 1) * MS, frame({i < 2 ? POLL : GO_IDLE}));
    bench.run(asked + 10 * MS);
    CHECK(bench.module.counts().frames_missed == 2);
    CHECK(bench.module.state() == Module::State::RUNNING);
    bench.tell({GO_IDLE});
    CHECK(bench.module.state() == Module::State::IDLE);
}

TEST_CASE("a receiver goes round the cells, and stays while a frame comes in") {
    ModuleBench bench("module_lab");
    constexpr Cycles VISIT = 81'920;  // 10.24 ms
    for (uint8_t i = 0; i < 9; i++) CHECK(bench.module.listening_cell(i * VISIT + 1) == i % 4);
    bench.module.hold_receiver(9 * VISIT - 100, 9 * VISIT + 100);
    CHECK(bench.module.listening_cell(9 * VISIT + 200) == 0);
    CHECK(bench.module.listening_cell(10 * VISIT - 1) == 0);
    CHECK(bench.module.listening_cell(10 * VISIT) == 1);
}

TEST_CASE("a program that acts by itself starts, sends, waits and is heard on the bus") {
    ModuleBench bench("module_alone");
    bench.run(AWAKE);
    bench.run_for(200 * MS);
    REQUIRE(!bench.events.empty());
    CHECK(bench.events[0].text == "setup\n");
    CHECK(bench.events[0].robot == 5);
    CHECK(bench.module.light(2, bench.now).rgb != std::array<uint8_t, 3>{});
    bench.run_for(5 * SECOND);
    std::vector<CellEmission> own;
    for (const auto &emission : bench.sent)
        if (emission.message.type == 0x22) own.push_back(emission);
    REQUIRE(own.size() > 30);
    for (size_t i = 0; i < own.size(); i++) {
        CHECK(own[i].message.data[0] == i);
        CHECK(own[i].cell == i % 4);
        CHECK(crc_is_right(own[i].message));
        if (i > 0) CHECK(own[i].at - own[i - 1].at == 100 * MS + FRAME_CYCLES);
    }
    REQUIRE(!bench.frames.empty());
    CHECK(bench.frames[0].frame.id == 0);  // to all
    CHECK(bench.frames[0].frame.data[0] == 0x3C);
    bench.frames.clear();
    CanFrame asked = frame({0x3A, 1}, 4);
    asked.id = (Y + 1) << 6;
    bench.tell(asked);
    bench.run_for(110 * MS);
    REQUIRE(!bench.frames.empty());
    CHECK(bench.frames[0].frame.dlc == 6);
    CHECK(bench.frames[0].frame.id == ((Y + 1) << 6 | (X + 1) << 1 | 1));
    CHECK(bench.frames[0].frame.data == std::array<uint8_t, 8>{0x3B, 0, Y, 1, 4, 0, 0, 0});
}

TEST_CASE("the EEPROM outlives a power cycle, the rest does not") {
    ModuleBench bench("module_alone");
    bench.run(3 * SECOND);
    CHECK(bench.module.eeprom(0x100) == 0);  // an erased byte, plus one
    bench.module.reset(bench.now);
    CHECK(bench.module.state() == Module::State::INIT);
    bench.run_for(3 * SECOND);
    CHECK(bench.module.eeprom(0x100) == 1);
    CHECK(bench.sent.back().message.data[0] < 20);
}

TEST_CASE("frames that come while a module starts are lost but for two") {
    ModuleBench bench("module_lab");
    bench.run(100 * MS);
    for (uint8_t i = 0; i < 5; i++) bench.module.receive_can(200 * MS + i * MS, frame({GO_SETUP}));
    bench.run(AWAKE);
    CHECK(bench.module.counts().frames_missed == 3);
    CHECK(bench.module.state() == Module::State::SETUP);
}

TEST_CASE("the module's own boot loader takes pages, and is left by a command or the last page") {
    ModuleBench bench("module_lab");
    bench.start({1, 2, 3, 4});
    bench.tell({TO_LOADER});
    CHECK(bench.module.state() == Module::State::BOOT_LOADER);
    CHECK(bench.module.light(0, bench.now + 10 * MS).color() == 4);
    CHECK(bench.module.light(0, bench.now + 210 * MS).color() == 0);
    bench.tell(frame({POLL}, 1));
    bench.run_for(5 * SECOND);
    CHECK(bench.sent.empty());
    CHECK(bench.frames.empty());
    constexpr uint8_t OLD = 0x9F;
    bench.tell({0x08 + OLD, 0, 1});
    bench.tell({0x09 + OLD, 0, 0});
    for (uint8_t part = 0; part < 22; part++) bench.tell({0x07 + OLD, part});
    CHECK(bench.module.state() == Module::State::INIT);
    CHECK(bench.events.size() == 1);
    bench.run_for(2 * SECOND);
    CHECK(bench.module.state() == Module::State::IDLE);
    bench.tell({TO_LOADER});
    bench.tell({GO_RUN});
    CHECK(bench.module.state() == Module::State::INIT);
}

TEST_CASE("a module whose program fails stops, reports why, and comes back when reset") {
    const std::pair<uint8_t, EventKind> cases[] = {{1, EventKind::CRASH}, {3, EventKind::CRASH}};
    for (auto [what, kind] : cases) {
        ModuleBench bench("module_faulty");
        bench.start({what, 0});
        bench.run_for(SECOND);
        CHECK(bench.module.stopped());
        REQUIRE(bench.events.size() == 1);
        CHECK(bench.events[0].kind == kind);
        bench.tell({GO_IDLE});
        CHECK(bench.module.next_event() == NEVER);
        bench.module.reset(bench.now);
        bench.run_for(2 * SECOND);
        CHECK(!bench.module.stopped());
        CHECK(bench.module.state() == Module::State::IDLE);
    }
}

TEST_CASE("a module whose loop never comes back is warned of, and stopped only if it computes") {
    ModuleBench waiting("module_faulty");
    waiting.start({4, 0});
    waiting.run_for(90 * SECOND);
    REQUIRE(waiting.events.size() == 1);
    CHECK(waiting.events[0].kind == EventKind::BUSY_WAIT);
    CHECK(!waiting.module.stopped());
    ModuleBench computing("module_faulty");
    computing.start({2, 0});
    computing.run_for(90 * SECOND);
    CHECK(computing.module.stopped());
    CHECK(computing.events.back().kind == EventKind::ENDLESS);
}

TEST_CASE("a robot's program is refused") {
    Chance chance(1);
    Events events;
    ModuleContext context{chance, events};
    auto &program = Program::load(guest("talker"), "talker");
    std::vector<uint8_t> image(program.state_bytes());
    CHECK_THROWS_WITH_AS(Module(context, program, 0, 0, 0, TICK_CYCLES, 0, image.data()),
                         "talker is a robot's program; a grid needs a module's", EngineError);
}

TEST_CASE("a module that is run ahead does what it does step by step") {
    for (const char *program : {"module_lab", "module_alone"}) {
        auto story = [program](Cycles step) {
            ModuleBench bench(program);
            uint32_t busy = 0;
            bench.channel = [&busy](const CellEmission &) {
                return ++busy % 7 == 0 ? Module::Answer::BUSY : Module::Answer::SENT;
            };
            auto run = [&bench, step](Cycles until) {
                while (bench.now < until) bench.run(std::min(bench.now + step, until));
            };
            run(AWAKE);
            bench.module.receive_can(bench.now, frame({CONFIG_SIZE, 0, 4}));
            bench.module.receive_can(bench.now + MS, frame({CONFIG, 0, 1, 2, 3, 4}));
            bench.module.receive_can(bench.now + 9 * MS, frame({GO_RUN}));
            for (Cycles i = 0; i < 12; i++)
                bench.module.receive_ir(bench.now + (3000 + i * 377) * MS, i % 4,
                                        tracking({static_cast<uint8_t>(i)}), {50, 50}, i == 5);
            bench.module.receive_can(bench.now + 8 * SECOND, frame({POLL}, 1));
            run(12 * SECOND);
            std::vector<uint64_t> told;
            for (const auto &e : bench.sent)
                told.insert(told.end(), {e.at, e.cell, e.message.type, e.message.crc});
            for (const auto &output : bench.frames)
                told.insert(told.end(), {output.at, output.frame.id, output.frame.data[1]});
            told.push_back(bench.module.ticks());
            const auto state = bench.loaded.state_of(bench.image.data());
            told.insert(told.end(), state.begin(), state.end());
            return told;
        };
        const auto by_ticks = story(TICK_CYCLES / 3);
        CHECK(story(TICK_CYCLES) == by_ticks);
        CHECK(story(100 * SECOND) == by_ticks);
    }
}

}  // namespace test_module
