/// A PCA9635, which dims 16 LEDs by PWM, as an I2C device (NXP PCA9635, revision 7).
///
/// An output is reported as its share of full light. Blinking in a group counts as dimming to the
/// share of the time that it is on.
#ifndef KILOTWIN_AVR_BOARDS_PCA9635_H
#define KILOTWIN_AVR_BOARDS_PCA9635_H

#include <array>
#include <cstdint>

namespace kilotwin {

/// One per module board: outputs 0 to 11 are red, green and blue of the four cells, in their order.
/// Timeless: a write shows at once.
class Pca9635 {
  public:
    static constexpr unsigned OUTPUTS = 16;

    /// `address`: 7 bits, as its pins are wired.
    explicit Pca9635(uint8_t address) : address_(address) { reset(); }

    // One transfer, from start to stop, as the master drives it. Each returns whether the device
    // acknowledges.
    /// The first byte: address and direction (1: read).
    bool address(uint8_t byte);
    /// A byte after the address: the control register first, then data.
    bool write(uint8_t byte);
    /// The next byte of a transfer that reads.
    uint8_t read();
    /// The stop condition; it completes the reset call.
    void stop();

    /// Light of an output (0 to OUTPUTS - 1), 0 to 255.
    uint8_t light(unsigned output) const;

    /// Power-up, or the reset call: asleep, all dark.
    void reset();

  private:
    void advance();  ///< to the next register, if the control register wants that

    uint8_t address_;
    std::array<uint8_t, 0x1C> registers_{};
    uint8_t control_ = 0;       ///< control register: register, and how to increment
    bool control_due_ = false;  ///< the next byte written is the control register
    uint8_t reset_bytes_ = 0;   ///< of a reset call, matched so far; NO_RESET_CALL in other calls
};

}  // namespace kilotwin

#endif
