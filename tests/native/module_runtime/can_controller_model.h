/// An MCP2515 as its SPI instructions show it (datasheet, chapters 11 and 12): registers, two
/// receive buffers, transmit buffer 0. What is on the bus is the test's business.
#ifndef KILOTWIN_TESTS_CAN_CONTROLLER_MODEL_H
#define KILOTWIN_TESTS_CAN_CONTROLLER_MODEL_H

#include <array>
#include <cstdint>
#include <vector>

namespace kilotwin {

class CanControllerModel {
  public:
    static constexpr uint8_t CANSTAT = 0x0E, CANCTRL = 0x0F, CANINTF = 0x2C, TXB0CTRL = 0x30;
    static constexpr uint8_t REQUESTED = 1 << 3;  ///< TXREQ of TXB0CTRL

    std::array<uint8_t, 128> registers{};
    bool there = true;
    std::vector<uint8_t> written_outside_configuration;  ///< registers that need that mode

    void select();
    void release();
    uint8_t exchange(uint8_t byte);

    /// A frame has come into receive buffer 0 or 1.
    void receive(int buffer, uint16_t id, bool rtr, const std::vector<uint8_t> &data);

    uint16_t id_at(uint8_t address) const {
        return static_cast<uint16_t>(registers[address] << 3 | registers[address + 1u] >> 5);
    }

  private:
    void reset();
    void write(uint8_t address, uint8_t value, uint8_t mask);
    uint8_t status() const;

    bool selected_ = false;
    unsigned count_ = 0;  ///< bytes of the instruction that have come
    uint8_t instruction_ = 0, address_ = 0, mask_ = 0;
};

/// The one that spi.h talks to.
extern CanControllerModel can_controller_model;

}  // namespace kilotwin

#endif
