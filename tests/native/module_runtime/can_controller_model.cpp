#include "can_controller_model.h"

#include <algorithm>

extern "C" {
#include "../../../kilogrid_modules/runtime/avr/spi.h"
}

namespace kilotwin {

namespace {

constexpr uint8_t MODES = 0xE0, CONFIGURATION = 0x80;
constexpr uint8_t RXB0SIDH = 0x61, RXB1SIDH = 0x71, TXB0SIDH = 0x31;

bool needs_configuration(uint8_t address) {
    const bool filter = address < 0x1C && (address & 0x0F) < 0x0C;
    return filter || (address >= 0x20 && address <= 0x2A);
}

}  // namespace

CanControllerModel can_controller_model;

void CanControllerModel::reset() {
    registers.fill(0);
    registers[CANSTAT] = CONFIGURATION;
    registers[CANCTRL] = 0x87;
}

void CanControllerModel::select() {
    selected_ = true;
    count_ = 0;
}

void CanControllerModel::release() {
    // What a whole instruction leaves behind when the chip select goes up.
    if (count_ == 1 && instruction_ == 0xC0) reset();
    if (count_ == 1 && instruction_ == 0x81) registers[TXB0CTRL] |= REQUESTED;
    if (instruction_ == 0x90) registers[CANINTF] &= static_cast<uint8_t>(~1);
    if (instruction_ == 0x94) registers[CANINTF] &= static_cast<uint8_t>(~2);
    instruction_ = 0;
    selected_ = false;
}

void CanControllerModel::write(uint8_t address, uint8_t value, uint8_t mask) {
    address &= 0x7F;
    if (needs_configuration(address) && (registers[CANSTAT] & MODES) != CONFIGURATION) {
        written_outside_configuration.push_back(address);
        return;
    }
    if (address == CANSTAT) return;
    registers[address] = static_cast<uint8_t>((registers[address] & ~mask) | (value & mask));
    if (address == CANCTRL) registers[CANSTAT] = value & MODES;
}

uint8_t CanControllerModel::status() const {
    return static_cast<uint8_t>((registers[CANINTF] & 3) |
                                ((registers[TXB0CTRL] & REQUESTED) != 0 ? 1 << 2 : 0));
}

uint8_t CanControllerModel::exchange(uint8_t byte) {
    if (!there || !selected_) return 0xFF;
    const unsigned at = count_++;
    if (at == 0) {
        instruction_ = byte;
        if (byte == 0x90) address_ = RXB0SIDH;
        if (byte == 0x94) address_ = RXB1SIDH;
        if (byte == 0x40) address_ = TXB0SIDH;
        return 0xFF;
    }
    switch (instruction_) {
    case 0x03:
        if (at == 1) address_ = byte;
        return at == 1 ? uint8_t{0xFF} : registers[address_++ & 0x7F];
    case 0x02:
        if (at == 1)
            address_ = byte;
        else
            write(address_++, byte, 0xFF);
        return 0xFF;
    case 0x05:
        if (at == 1) address_ = byte;
        if (at == 2) mask_ = byte;
        if (at == 3) write(address_, byte, mask_);
        return 0xFF;
    case 0xA0: return status();
    case 0x90:
    case 0x94: return registers[address_++ & 0x7F];
    case 0x40: registers[address_++ & 0x7F] = byte; return 0xFF;
    default: return 0xFF;
    }
}

void CanControllerModel::receive(int buffer, uint16_t id, bool rtr,
                                 const std::vector<uint8_t> &data) {
    const uint8_t base = buffer == 0 ? RXB0SIDH : RXB1SIDH;
    registers[base] = static_cast<uint8_t>(id >> 3);
    registers[base + 1u] = static_cast<uint8_t>(id << 5 | (rtr ? 1 << 4 : 0));
    registers[base + 4u] = static_cast<uint8_t>(data.size());
    std::copy(data.begin(), data.end(), registers.begin() + base + 5);
    registers[CANINTF] |= static_cast<uint8_t>(1 << buffer);
}

}  // namespace kilotwin

extern "C" {
void runtime_spi_init(void) {}
void runtime_spi_select(void) { kilotwin::can_controller_model.select(); }
void runtime_spi_release(void) { kilotwin::can_controller_model.release(); }
uint8_t runtime_spi_exchange(uint8_t byte) { return kilotwin::can_controller_model.exchange(byte); }
}
