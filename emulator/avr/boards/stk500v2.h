/// A programmer for AVR chips that a PC drives by a serial line: an AVRISP with the protocol
/// STK500 version 2, as Atmel's application note AVR068 has it. avrdude knows it as
/// `-c stk500v2`; the AVRISP mkII takes the same commands by USB.
#ifndef KILOTWIN_AVR_BOARDS_STK500V2_H
#define KILOTWIN_AVR_BOARDS_STK500V2_H

#include <cstdint>
#include <span>
#include <vector>

#include "avr/chip/serial_programming.h"

namespace kilotwin {

/// Takes what the PC sends, in pieces of any length, and returns what it answers. It has no clock,
/// so the time-outs of AVR068 are left out: a message that was cut off swallows the begin of the
/// next one, and the PC, which repeats what is not answered, brings both into step again.
class Stk500v2 {
  public:
    using Message = std::vector<uint8_t>;

    /// Longest body of a message.
    static constexpr size_t BODY_MOST = 275;

    /// A programmer in front of a chip with `memory`, which must live on.
    explicit Stk500v2(ChipMemory &memory) : chip_(memory) {}

    /// Takes any bytes; returns answers to the messages that have ended with them, mostly one or
    /// none. A message with a wrong checksum is answered as such; what does not begin as a message
    /// is passed over.
    Message receive(std::span<const uint8_t> bytes);

    /// The PC has closed the line: a message begun is forgotten and the chip's reset released.
    void hang_up();

    /// Whether the chip is held in reset and has accepted to be programmed.
    bool programming() const { return chip_.enabled(); }

  private:
    enum State : uint8_t { START, SEQUENCE, SIZE_HIGH, SIZE_LOW, TOKEN, BODY, CHECKSUM };

    // Messages: the frame's bytes, and the body's answer.
    bool take(uint8_t byte);
    Message framed(const Message &body) const;
    Message answer();
    Message answer_about_chip();

    // Bodies of answers; the message is in body_.
    /// The command and its status, as most commands are answered.
    Message status(uint8_t code) const { return {body_[0], code}; }
    Message set_parameter();
    Message parameter() const;
    Message enter();
    Message write_memory(bool flash);
    Message read_memory(bool flash);
    Message read_one();
    Message exchange();

    SerialProgramming::Bytes shift_from_body(size_t at);
    uint8_t shift(uint8_t first, uint32_t address, uint8_t value);

    SerialProgramming chip_;
    State state_ = START;  ///< of the message: what comes next
    uint8_t sequence_ = 0, checksum_ = 0;
    size_t size_ = 0;  ///< of the body, as announced
    Message body_;
    uint32_t address_ = 0;        ///< set by LOAD_ADDRESS: words of flash, bytes of EEPROM
    uint8_t clock_duration_ = 0;  ///< of the SPI, as the PC wants it; there is no clock here
};

}  // namespace kilotwin

#endif
