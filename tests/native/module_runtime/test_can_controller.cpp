/// The module's driver of its CAN controller (hardware.md 3.2), against the emulator's chip.
#include <doctest/doctest.h>

#include <algorithm>
#include <initializer_list>

#include "avr/boards/mcp2515.h"

extern "C" {
#include "../../../kilogrid_modules/protocol/address.h"
#include "../../../kilogrid_modules/runtime/avr/can_controller.h"
#include "../../../kilogrid_modules/runtime/avr/spi.h"
}

using namespace kilotwin;

namespace {

constexpr uint8_t READ = 0x03;

Mcp2515 chip;
bool is_there = true;

void start(uint8_t x, uint8_t y) {
    chip = Mcp2515();
    is_there = true;
    uint16_t ids[KILOGRID_FILTERS];
    REQUIRE(kilogrid_filters(x, y, ids));
    REQUIRE(runtime_can_controller_init(ids, KILOGRID_MODULE_MASK));
}

uint8_t read(uint8_t address) {
    chip.select();
    chip.exchange(READ);
    chip.exchange(address);
    const uint8_t value = chip.exchange(0);
    chip.release();
    return value;
}

int id_at(uint8_t address) {
    return read(address) << 3 | read(static_cast<uint8_t>(address + 1)) >> 5;
}

CanFrame frame_of(uint16_t id, std::initializer_list<uint8_t> data) {
    CanFrame frame;
    frame.id = id;
    frame.dlc = static_cast<uint8_t>(data.size());
    std::copy(data.begin(), data.end(), frame.data.begin());
    return frame;
}

}  // namespace

extern "C" {
void runtime_spi_init(void) {}
void runtime_spi_select(void) { chip.select(); }
void runtime_spi_release(void) { chip.release(); }
uint8_t runtime_spi_exchange(uint8_t byte) { return is_there ? chip.exchange(byte) : 0xFF; }
}

TEST_CASE("a bit has 8 quanta of 500 ns and is sampled at 62.5 per cent") {
    start(3, 7);
    CHECK(read(0x2A) == 0x01);  // CNF1: jump 1 quantum, clock / 4
    CHECK(read(0x29) == 0x90);  // CNF2: propagation 1, phase one 3, one sample
    CHECK(read(0x28) == 0x02);  // CNF3: phase two 3
    CHECK(chip.takes_part());
}

TEST_CASE("the controller takes broadcasts, its row, its column and its own, to the bit") {
    start(3, 7);
    CHECK(id_at(0x20) == 0x7FF);
    CHECK(id_at(0x24) == 0x7FF);
    CHECK(id_at(0x00) == 0x000);
    CHECK(id_at(0x04) == (7 + 1) << 6);
    CHECK(id_at(0x08) == (3 + 1) << 1);
    for (uint8_t filter : {0x10, 0x14, 0x18}) CHECK(id_at(filter) == (8 << 6 | 4 << 1));
    CHECK((read(0x60) & 0x64) == 0x04);  // RXB0CTRL: filters on, rolls over
    CHECK((read(0x70) & 0x60) == 0x00);  // RXB1CTRL: filters on
    CHECK(read(0x2B) == 0x03);           // CANINTE: on reception
    can_frame_t frame;
    chip.receive(frame_of(8 << 6 | 5 << 1, {1}));
    chip.receive(frame_of(8 << 6 | 4 << 1 | 1, {1}));
    CHECK_FALSE(runtime_can_controller_receive(&frame));
    chip.receive(frame_of(8 << 6 | 4 << 1, {1}));
    CHECK(runtime_can_controller_receive(&frame));
}

TEST_CASE("a controller that is not there is noticed") {
    is_there = false;
    const uint16_t ids[CAN_FILTERS] = {};
    CHECK_FALSE(runtime_can_controller_init(ids, 0x7FF));
}

TEST_CASE("frames are taken out of both buffers and free them") {
    start(0, 0);
    can_frame_t frame;
    CHECK_FALSE(runtime_can_controller_receive(&frame));
    chip.receive(frame_of(0x042, {1, 2, 3}));
    chip.receive(frame_of(0x000, {9, 8, 7, 6, 5, 4, 3, 2}));
    CHECK(chip.interrupts());
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.id == 0x000);
    CHECK(frame.length == 8);
    CHECK(frame.data[0] == 9);
    CHECK(frame.data[7] == 2);
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.id == 0x042);
    CHECK(frame.length == 3);
    CHECK_FALSE(frame.rtr);
    CHECK_FALSE(runtime_can_controller_receive(&frame));
    CHECK_FALSE(chip.interrupts());
    CanFrame remote = frame_of(0x000, {});
    remote.rtr = true;
    chip.receive(remote);
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.rtr);
    CHECK(frame.length == 0);
}

TEST_CASE("a frame with more than 8 data bytes in its header has 8") {
    start(0, 0);
    CanFrame long_frame = frame_of(0x000, {1});
    long_frame.dlc = 15;
    chip.receive(long_frame);
    can_frame_t frame;
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.length == 8);
}

TEST_CASE("a frame is loaded and requested; the next one waits until it is out") {
    start(0, 0);
    const can_frame_t frame = {0x0D7, false, 3, {0x14, 2, 5}};
    REQUIRE(runtime_can_controller_send(&frame));
    const auto on_bus = chip.next_to_send();
    REQUIRE(on_bus);
    CHECK(*on_bus == frame_of(0x0D7, {0x14, 2, 5}));
    CHECK_FALSE(runtime_can_controller_send(&frame));
    chip.sent();
    CHECK(runtime_can_controller_send(&frame));
}

TEST_CASE("error counters are read, and an overflow is told once") {
    start(0, 0);
    chip.set_errors(96, 5, false);
    for (int i = 0; i < 3; i++) chip.receive(frame_of(0x000, {}));
    const can_health_t first = runtime_can_controller_health(),
                       second = runtime_can_controller_health();
    CHECK(first.transmit_errors == 96);
    CHECK(first.receive_errors == 5);
    CHECK(first.missed == 1);
    CHECK(second.missed == 0);
    CHECK((read(0x2D) & 0x07) == 0x05);  // the warnings stay
}
