/// An MCP2515, the Kilogrid's CAN controller, between its SPI port and a bus (Microchip DS20001801).
///
/// Modelled: all SPI instructions, modes, masks and filters (the data bytes of standard frames included), two receive
/// buffers with rollover and overflow, three transmit buffers with priorities, interrupts and their pin, error
/// counters and flags as the bus tells them, bit timing as far as that it must be the bus's.
/// Not modelled: extended identifiers (nobody sends any), one-shot mode, the pins RXnBF and TXnRTS; a mode is taken at
/// once, not after 11 recessive bits; a buffer of higher priority does not overtake one that the bus already has.
#ifndef KILOTWIN_AVR_BOARDS_MCP2515_H
#define KILOTWIN_AVR_BOARDS_MCP2515_H

#include <array>
#include <cstdint>
#include <optional>

#include "base/can_frame.h"

namespace kilotwin {

class Mcp2515 {
  public:
    Mcp2515() { reset(); }

    // Its SPI port. An instruction is what comes from select() to release().
    void select();
    uint8_t exchange(uint8_t byte);
    void release();

    /// Its interrupt pin is low.
    bool interrupts() const;

    // Its end of the bus, of 250 kbit/s at a clock of 8 MHz.

    /// It acknowledges, receives and sends: in normal mode, with the bus's bit timing.
    bool takes_part() const;
    /// A frame that another node sent is over.
    void receive(const CanFrame &frame);
    /// What it wants to send next; it then has no other until sent() or gives_up().
    std::optional<CanFrame> next_to_send();
    /// The bus has taken that frame to its end, or lost it.
    void sent();
    void gives_up() { sending_.reset(); }
    /// The bus's account of its errors.
    void set_errors(uint32_t transmit, uint32_t receive, bool bus_off);

    /// Frames that found both buffers full.
    uint32_t missed() const { return missed_; }

    /// Power comes, or the reset instruction.
    void reset();

  private:
    enum class Mode : uint8_t { NORMAL, SLEEP, LOOPBACK, LISTEN_ONLY, CONFIGURATION };

    Mode mode() const;
    uint8_t read(uint8_t address) const;
    void write(uint8_t address, uint8_t value, uint8_t mask = 0xFF);
    void write_control(uint8_t value);
    uint8_t data_byte(uint8_t byte, unsigned at);
    void obey(uint8_t instruction);
    uint8_t status() const;
    uint8_t receive_status() const;
    uint8_t interrupt_code() const;
    bool passes(unsigned filter, unsigned mask, const CanFrame &frame) const;
    std::optional<unsigned> filter_of(unsigned buffer, const CanFrame &frame) const;
    void take(const CanFrame &frame);
    void store(unsigned buffer, unsigned filter, const CanFrame &frame);
    void request(unsigned buffer);
    void flag(uint8_t bits);

    std::array<uint8_t, 128> registers_{};
    std::optional<unsigned> sending_;  ///< transmit buffer whose frame the bus has
    uint32_t missed_ = 0;
    bool selected_ = false;
    unsigned count_ = 0;  ///< bytes of the instruction so far
    uint8_t instruction_ = 0, address_ = 0, mask_ = 0;
};

}  // namespace kilotwin

#endif
