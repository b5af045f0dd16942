/// The module's driver of its CAN controller (hardware.md 3.2), against a model of the chip.
#include <doctest/doctest.h>

#include <cstring>

#include "can_controller_model.h"

extern "C" {
#include "../../../kilogrid_modules/protocol/address.h"
#include "../../../kilogrid_modules/runtime/avr/can_controller.h"
}

using namespace kilotwin;

namespace {

CanControllerModel &start(uint8_t x, uint8_t y) {
    can_controller_model = CanControllerModel();
    uint16_t ids[KILOGRID_FILTERS];
    REQUIRE(kilogrid_filters(x, y, ids));
    REQUIRE(runtime_can_controller_init(ids, KILOGRID_MODULE_MASK));
    return can_controller_model;
}

}  // namespace

TEST_CASE("a bit has 8 quanta of 500 ns and is sampled at 62.5 per cent") {
    auto &chip = start(3, 7);
    CHECK(chip.registers[0x2A] == 0x01);  // CNF1: jump 1 quantum, clock / 4
    CHECK(chip.registers[0x29] == 0x90);  // CNF2: propagation 1, phase one 3, one sample
    CHECK(chip.registers[0x28] == 0x02);  // CNF3: phase two 3
    CHECK(chip.written_outside_configuration.empty());
}

TEST_CASE("the controller takes broadcasts, its row, its column and its own, to the bit") {
    auto &chip = start(3, 7);
    CHECK(chip.id_at(0x20) == 0x7FF);
    CHECK(chip.id_at(0x24) == 0x7FF);
    CHECK(chip.id_at(0x00) == 0x000);
    CHECK(chip.id_at(0x04) == (7 + 1) << 6);
    CHECK(chip.id_at(0x08) == (3 + 1) << 1);
    for (uint8_t filter : {0x10, 0x14, 0x18}) CHECK(chip.id_at(filter) == (8 << 6 | 4 << 1));
    CHECK((chip.registers[0x60] & 0x64) == 0x04);  // RXB0CTRL: filters on, rolls over
    CHECK((chip.registers[0x70] & 0x60) == 0x00);  // RXB1CTRL: filters on
    CHECK(chip.registers[0x2B] == 0x03);           // CANINTE: on reception
    CHECK((chip.registers[CanControllerModel::CANSTAT] & 0xE0) == 0);
}

TEST_CASE("a controller that is not there is noticed") {
    can_controller_model = CanControllerModel();
    can_controller_model.there = false;
    const uint16_t ids[CAN_FILTERS] = {};
    CHECK_FALSE(runtime_can_controller_init(ids, 0x7FF));
}

TEST_CASE("frames are taken out of both buffers and free them") {
    auto &chip = start(0, 0);
    can_frame_t frame;
    CHECK_FALSE(runtime_can_controller_receive(&frame));
    chip.receive(1, 0x7A5, false, {1, 2, 3});
    chip.receive(0, 0x042, false, {9, 8, 7, 6, 5, 4, 3, 2});
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.id == 0x042);
    CHECK(frame.length == 8);
    CHECK(frame.data[0] == 9);
    CHECK(frame.data[7] == 2);
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.id == 0x7A5);
    CHECK(frame.length == 3);
    CHECK_FALSE(frame.rtr);
    CHECK_FALSE(runtime_can_controller_receive(&frame));
    chip.receive(0, 0x000, true, {});
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.rtr);
    CHECK(frame.length == 0);
}

TEST_CASE("a frame with more than 8 data bytes in its header has 8") {
    auto &chip = start(0, 0);
    chip.receive(0, 1, false, {1});
    chip.registers[0x65] = 0x0F;
    can_frame_t frame;
    REQUIRE(runtime_can_controller_receive(&frame));
    CHECK(frame.length == 8);
}

TEST_CASE("a frame is loaded and requested; the next one waits until it is out") {
    auto &chip = start(0, 0);
    const can_frame_t frame = {0x0D7, false, 3, {0x14, 2, 5}};
    REQUIRE(runtime_can_controller_send(&frame));
    CHECK(chip.id_at(0x31) == 0x0D7);
    CHECK((chip.registers[0x32] & 0x08) == 0);  // no extended identifier
    CHECK(chip.registers[0x35] == 3);           // a data frame
    CHECK(chip.registers[0x36] == 0x14);
    CHECK(chip.registers[0x38] == 5);
    CHECK((chip.registers[CanControllerModel::TXB0CTRL] & CanControllerModel::REQUESTED) != 0);
    CHECK_FALSE(runtime_can_controller_send(&frame));
    chip.registers[CanControllerModel::TXB0CTRL] = 0;
    CHECK(runtime_can_controller_send(&frame));
}

TEST_CASE("error counters are read, and an overflow is told once") {
    auto &chip = start(0, 0);
    chip.registers[0x1C] = 96;
    chip.registers[0x1D] = 5;
    chip.registers[0x2D] = 0x40 | 0x01;
    const can_health_t first = runtime_can_controller_health(),
                       second = runtime_can_controller_health();
    CHECK(first.transmit_errors == 96);
    CHECK(first.receive_errors == 5);
    CHECK(first.missed == 1);
    CHECK(second.missed == 0);
    CHECK(chip.registers[0x2D] == 0x01);
}
