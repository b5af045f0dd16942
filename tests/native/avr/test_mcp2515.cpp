// The CAN controller, byte by byte at its SPI port and frame by frame at its end of the bus.
#include <doctest/doctest.h>

#include <initializer_list>
#include <vector>

#include "avr/boards/mcp2515.h"

using namespace kilotwin;

namespace test_mcp2515 {

namespace {

enum : uint8_t {
    RESET = 0xC0,
    READ = 3,
    WRITE = 2,
    MODIFY = 5,
    READ_STATUS = 0xA0,
    RX_STATUS = 0xB0
};
enum : uint8_t {
    CANSTAT = 0x0E,
    CANCTRL = 0x0F,
    TEC = 0x1C,
    REC = 0x1D,
    CNF3 = 0x28,
    CANINTE = 0x2B,
    CANINTF = 0x2C,
    EFLG = 0x2D,
    TXB0CTRL = 0x30,
    RXB0CTRL = 0x60,
    RXB1CTRL = 0x70
};
enum : uint8_t {
    NORMAL = 0x00,
    SLEEP = 0x20,
    LOOPBACK = 0x40,
    LISTEN_ONLY = 0x60,
    CONFIGURATION = 0x80
};

struct Bench {
    std::vector<uint8_t> tell(std::initializer_list<uint8_t> bytes) {
        std::vector<uint8_t> answers;
        chip.select();
        for (uint8_t byte : bytes) answers.push_back(chip.exchange(byte));
        chip.release();
        return answers;
    }
    uint8_t read(uint8_t address) { return tell({READ, address, 0}).back(); }
    void write(uint8_t address, uint8_t value) { tell({WRITE, address, value}); }
    void write_id(uint8_t address, uint16_t id) {
        tell({WRITE, address, static_cast<uint8_t>(id >> 3), static_cast<uint8_t>(id << 5)});
    }

    /// At 250 kbit/s, with both masks full and filters 0 to 5 for identifiers 0x100 to 0x105.
    void start(uint8_t mode = NORMAL) {
        tell({RESET});
        tell({WRITE, CNF3, 0x02, 0x90, 0x01});
        write_id(0x20, 0x7FF);
        write_id(0x24, 0x7FF);
        for (unsigned i = 0; i < 6; i++)
            write_id(static_cast<uint8_t>(4 * i + (i < 3 ? 0 : 4)),
                     static_cast<uint16_t>(0x100 + i));
        write(CANCTRL, mode);
    }
    static CanFrame frame(uint16_t id, std::initializer_list<uint8_t> data = {}) {
        CanFrame frame;
        frame.id = id;
        frame.dlc = static_cast<uint8_t>(data.size());
        std::copy(data.begin(), data.end(), frame.data.begin());
        return frame;
    }
    void load(unsigned buffer, uint16_t id, uint8_t priority) {
        const auto base = static_cast<uint8_t>(TXB0CTRL + 16 * buffer);
        write_id(base + 1, id);
        write(base + 5, 1);
        write(base + 6, static_cast<uint8_t>(0x40 + buffer));
        write(base, static_cast<uint8_t>(priority));
    }

    Mcp2515 chip;
};

}  // namespace

TEST_CASE("it comes up configurable and takes part when it is set to the bus's bit timing") {
    Bench bench;
    CHECK(bench.read(CANSTAT) == CONFIGURATION);
    CHECK(bench.read(CANCTRL) == 0x87);
    CHECK(bench.read(0x5E) == CONFIGURATION);  // in every row
    CHECK_FALSE(bench.chip.takes_part());
    bench.start();
    CHECK(bench.read(CANSTAT) == NORMAL);
    CHECK(bench.chip.takes_part());
    bench.write(CANCTRL, CONFIGURATION);
    bench.write(0x2A, 0x00);  // twice as fast
    bench.write(CANCTRL, NORMAL);
    CHECK_FALSE(bench.chip.takes_part());
    bench.tell({RESET});
    CHECK(bench.read(CANSTAT) == CONFIGURATION);
    CHECK(bench.read(0x2A) == 0x00);
}

TEST_CASE("filters, masks and bit timing are kept outside configuration") {
    Bench bench;
    bench.start();
    for (uint8_t address : {0x00, 0x11, 0x20, 0x27, 0x28, 0x2A}) {
        const uint8_t before = bench.read(address);
        bench.write(address, static_cast<uint8_t>(before ^ 0xFF));
        CHECK(bench.read(address) == before);
    }
    bench.write(CANSTAT, 0xFF);
    CHECK(bench.read(CANSTAT) == NORMAL);
}

TEST_CASE("a frame goes into the buffer whose filter it passes, and reading frees it") {
    Bench bench;
    bench.start();
    bench.write(CANINTE, 3);
    bench.chip.receive(Bench::frame(0x200, {1}));
    CHECK_FALSE(bench.chip.interrupts());
    bench.chip.receive(Bench::frame(0x103, {7, 8}));
    CHECK(bench.chip.interrupts());
    CHECK(bench.tell({READ_STATUS, 0}).back() == 2);
    CHECK(bench.tell({RX_STATUS, 0}).back() == (2 << 6 | 3));
    CHECK((bench.read(CANSTAT) >> 1 & 7) == 7);
    CanFrame remote = Bench::frame(0x101, {0, 0, 0});
    remote.rtr = true;
    bench.chip.receive(remote);
    CHECK(bench.tell({RX_STATUS, 0}).back() == (3 << 6 | 1 << 3 | 1));
    // READ RX BUFFER: all of buffer 0, then the data of buffer 1.
    CHECK(bench.tell({0x90, 0, 0, 0, 0, 0}) == std::vector<uint8_t>{0xFF, 0x20, 0x30, 0, 0, 3});
    CHECK(bench.tell({0x96, 0, 0}) == std::vector<uint8_t>{0xFF, 7, 8});
    CHECK_FALSE(bench.chip.interrupts());
    CHECK(bench.read(0x75) == 2);
}

TEST_CASE("masks may let more through, by identifier and by the first data bytes") {
    Bench bench;
    bench.tell({RESET});
    bench.tell({WRITE, CNF3, 0x02, 0x90, 0x01});
    bench.tell(
        {WRITE, 0x20, 0xE0, 0x00, 0xFF, 0x00});  // three bits of the identifier, the first byte
    bench.tell({WRITE, 0x00, 0x40, 0x00, 0x55, 0x77});
    bench.tell({WRITE, 0x04, 0x40, 0x08, 0x00, 0x00});  // extended identifiers only
    bench.tell({WRITE, 0x24, 0xFF, 0xE0, 0x00, 0x00});
    for (uint8_t filter : {0x08, 0x10, 0x14, 0x18}) bench.tell({WRITE, filter, 0xFF, 0xE0});
    bench.write(CANCTRL, NORMAL);
    bench.chip.receive(Bench::frame(0x2AB, {0x54, 0x77}));
    CHECK(bench.read(CANINTF) == 0);
    bench.chip.receive(Bench::frame(0x2AB, {0x55, 0x00}));
    CHECK(bench.read(CANINTF) == 1);
    // Both bits of RXM: whatever comes.
    bench.write(RXB1CTRL, 0x60);
    bench.chip.receive(Bench::frame(0x001));
    CHECK(bench.read(CANINTF) == 3);
}

TEST_CASE("what finds its buffer full rolls over if it may, and is counted as missed if not") {
    for (bool rolls : {false, true}) {
        CAPTURE(rolls);
        Bench bench;
        bench.start();
        bench.write(RXB0CTRL, rolls ? 4 : 0);
        bench.chip.receive(Bench::frame(0x100, {1}));
        bench.chip.receive(Bench::frame(0x101, {2}));
        CHECK(bench.read(0x66) == 1);
        CHECK((bench.read(CANINTF) & 3) == (rolls ? 3 : 1));
        CHECK((bench.read(EFLG) & 0xC0) == (rolls ? 0 : 0x40));
        if (rolls) {
            CHECK(bench.read(0x76) == 2);
            bench.write(CANINTF, 2);
            CHECK(bench.tell({RX_STATUS, 0}).back() == (2 << 6 | 7));  // filter 1, rolled over
            bench.write(CANINTF, 3);
            bench.chip.receive(Bench::frame(0x100, {3}));
            CHECK((bench.read(EFLG) & 0xC0) == 0x80);
        }
        CHECK(bench.chip.missed() == 1);
        bench.tell({MODIFY, EFLG, 0xC0, 0});
        CHECK((bench.read(EFLG) & 0xC0) == 0);
    }
}

TEST_CASE("transmit buffers go out by priority, of equals the highest first, one at a time") {
    Bench bench;
    bench.start();
    bench.write(CANINTE, 1 << 2 | 1 << 4);
    bench.load(0, 0x010, 1);
    bench.load(1, 0x011, 3);
    bench.load(2, 0x012, 1);
    CHECK_FALSE(bench.chip.next_to_send());
    bench.tell({0x87});  // REQUEST TO SEND, all three
    CHECK(bench.tell({READ_STATUS, 0}).back() == (1 << 2 | 1 << 4 | 1 << 6));
    std::vector<uint16_t> order;
    for (int i = 0; i < 3; i++) {
        const auto frame = bench.chip.next_to_send();
        REQUIRE(frame);
        CHECK(frame->dlc == 1);
        CHECK(frame->data[0] == 0x40 + (frame->id & 3));
        order.push_back(frame->id);
        CHECK_FALSE(bench.chip.next_to_send());
        bench.chip.sent();
    }
    CHECK(order == std::vector<uint16_t>{0x011, 0x012, 0x010});
    CHECK(bench.read(CANINTF) == (1 << 2 | 1 << 3 | 1 << 4));
    CHECK(bench.chip.interrupts());
    CHECK((bench.read(CANSTAT) >> 1 & 7) == 3);  // transmit buffer 0
    CHECK_FALSE(bench.chip.next_to_send());
}

TEST_CASE("a buffer is loaded at once, is kept while it waits, and can be taken back") {
    Bench bench;
    bench.start();
    bench.tell({0x42, 0x12, 0x60, 0, 0, 2, 0xAA, 0xBB});  // LOAD TX BUFFER 1
    bench.tell({0x82});
    bench.write(0x46, 0xCC);
    CHECK(bench.read(0x46) == 0xAA);
    bench.tell({MODIFY, 0x40, 8, 0});
    CHECK(bench.read(0x40) == 1 << 6);  // ABTF
    CHECK_FALSE(bench.chip.next_to_send());
    bench.tell({0x82});
    bench.write(CANCTRL, 1 << 4);  // ABAT
    CHECK(bench.read(0x40) == 1 << 6);
    bench.write(CANCTRL, NORMAL);
    bench.tell({0x43, 0xDD});  // its data only
    bench.tell({0x82});
    const auto frame = bench.chip.next_to_send();
    REQUIRE(frame);
    CHECK(frame->id == 0x093);
    CHECK(frame->data[0] == 0xDD);
    CHECK(frame->data[1] == 0xBB);
    // Lost on the bus, it is tried again.
    bench.chip.gives_up();
    CHECK(bench.chip.next_to_send());
}

TEST_CASE("modes: it listens only, hears itself, sleeps and is woken") {
    Bench bench;
    bench.start(LISTEN_ONLY);
    bench.load(0, 0x010, 0);
    bench.tell({0x81});
    CHECK_FALSE(bench.chip.next_to_send());
    bench.chip.receive(Bench::frame(0x100));
    CHECK(bench.read(CANINTF) == 1);
    bench.start(LOOPBACK);
    bench.load(0, 0x102, 0);
    bench.tell({0x81});
    CHECK(bench.read(CANINTF) == (1 << 1 | 1 << 2));
    CHECK(bench.read(0x76) == 0x40);
    bench.start(SLEEP);
    bench.write(CANINTE, 1 << 6);
    bench.chip.receive(Bench::frame(0x100));
    CHECK(bench.read(CANINTF) == 1 << 6);
    CHECK((bench.read(CANSTAT) & 0xE0) == LISTEN_ONLY);
}

TEST_CASE("error counters raise flags, and an interrupt when they change") {
    Bench bench;
    bench.start();
    bench.write(CANINTE, 1 << 5);
    bench.chip.set_errors(8, 0, false);
    CHECK_FALSE(bench.chip.interrupts());
    CHECK(bench.read(TEC) == 8);
    bench.chip.set_errors(100, 130, false);
    CHECK(bench.read(EFLG) == (1 << 0 | 1 << 1 | 1 << 2 | 1 << 3));
    CHECK(bench.read(REC) == 130);
    CHECK(bench.chip.interrupts());
    CHECK((bench.read(CANSTAT) >> 1 & 7) == 1);
    bench.write(CANINTF, 0);
    bench.chip.set_errors(256, 0, true);
    CHECK(bench.read(EFLG) == (1 << 0 | 1 << 2 | 1 << 4 | 1 << 5));
    CHECK(bench.chip.interrupts());
    bench.write(TEC, 0);
    CHECK(bench.read(TEC) == 255);
}

}  // namespace test_mcp2515
