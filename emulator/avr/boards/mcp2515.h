/// An MCP2515, the Kilogrid's CAN controller, between its SPI port and a bus (Microchip
/// DS20001801).
///
/// Modelled: all SPI instructions, modes, masks and filters (on the data bytes of standard frames
/// too), two receive buffers with rollover and overflow, three transmit buffers with priorities,
/// interrupts and their pin, error counters and flags as the bus counts them, and the bit timing,
/// as far as that it has to be the bus's.
///
/// Not modelled: extended identifiers (no Kilogrid frame has one), one-shot mode, the pins RXnBF
/// and TXnRTS. A mode is entered at once, not after 11 recessive bits; a buffer of higher priority
/// does not overtake one that the bus already has.
///
/// Timeless: every call takes effect at once, and a byte of an SPI instruction costs O(1).
#ifndef KILOTWIN_AVR_BOARDS_MCP2515_H
#define KILOTWIN_AVR_BOARDS_MCP2515_H

#include <array>
#include <cstdint>
#include <optional>

#include "base/can_frame.h"

namespace kilotwin {

/// One per module board. The chip's SPI drives one side, the grid's bus the other; after either,
/// the board looks at interrupts() and next_to_send().
class Mcp2515 {
  public:
    Mcp2515() { reset(); }

    // The SPI port. An instruction is the bytes from select() to release().
    void select();
    /// Shifts a byte in; returns the byte that is shifted out, 0xFF while not selected.
    uint8_t exchange(uint8_t byte);
    void release();

    /// Whether the interrupt pin is low: an enabled interrupt is pending.
    bool interrupts() const;

    // The bus: 250 kbit/s at a clock of 8 MHz.

    /// Whether it acknowledges, receives and sends: in normal mode, with the bus's bit timing.
    bool takes_part() const;
    /// A frame of another node has reached its end.
    void receive(const CanFrame &frame);
    /// The frame to send next, of the transmit buffer with the highest priority; none if there is
    /// none, or while the frame returned last is still with the bus (until sent() or gives_up()).
    std::optional<CanFrame> next_to_send();
    /// The frame returned last has reached its end.
    void sent();
    /// The bus has lost that frame: next_to_send() returns it again while its request stands.
    void gives_up() { sending_.reset(); }
    /// The bus's error counters of this node; values above 255 show as 255.
    void set_errors(uint32_t transmit, uint32_t receive, bool bus_off);

    /// Frames that were accepted by a filter but found no free buffer.
    uint32_t missed() const { return missed_; }

    /// Power-up, or the reset instruction: configuration mode, buffers empty.
    void reset();

  private:
    enum class Mode : uint8_t { NORMAL, SLEEP, LOOPBACK, LISTEN_ONLY, CONFIGURATION };

    Mode mode() const;
    /// A register, 0x00 to 0x7F; some addresses show other registers.
    uint8_t read(uint8_t address) const;
    /// Only the bits of `mask`, and only where the mode allows it.
    void write(uint8_t address, uint8_t value, uint8_t mask = 0xFF);
    void write_control(uint8_t value);
    uint8_t data_byte(uint8_t byte, unsigned at);
    void begin_instruction(uint8_t instruction);
    uint8_t status() const;
    uint8_t receive_status() const;
    uint8_t interrupt_code() const;
    bool passes(unsigned filter, unsigned mask, const CanFrame &frame) const;
    std::optional<unsigned> filter_of(unsigned buffer, const CanFrame &frame) const;
    void accept(const CanFrame &frame);
    void store(unsigned buffer, unsigned filter, const CanFrame &frame);
    void request(unsigned buffer);
    void flag(uint8_t bits);

    std::array<uint8_t, 128> registers_{};
    std::optional<unsigned> sending_;  ///< transmit buffer whose frame the bus has
    uint32_t missed_ = 0;
    bool selected_ = false;
    unsigned count_ = 0;  ///< bytes of the present instruction so far
    uint8_t instruction_ = 0, address_ = 0, mask_ = 0;
};

}  // namespace kilotwin

#endif
