/// A PCA9635, which dims 16 LEDs by PWM, as an I2C device (NXP PCA9635, revision 7).
///
/// What an LED shows is told as its share of full light. Blinking in a group counts as dimming to the share of the
/// time that it is on.
#ifndef KILOTWIN_AVR_BOARDS_PCA9635_H
#define KILOTWIN_AVR_BOARDS_PCA9635_H

#include <array>
#include <cstdint>

namespace kilotwin {

class Pca9635 {
  public:
    static constexpr unsigned OUTPUTS = 16;

    /// `address` is what its pins say: 7 bits.
    explicit Pca9635(uint8_t address) : address_(address) { reset(); }

    // As the master sees it, from a start to a stop.
    /// The first byte: address and direction (1: read). Whether it acknowledges.
    bool address(uint8_t byte);
    bool write(uint8_t byte);
    uint8_t read();
    void stop();

    /// What an LED shows, 0 to 255.
    uint8_t light(unsigned output) const;

    /// Power comes: asleep, all dark.
    void reset();

  private:
    void advance();

    uint8_t address_;
    std::array<uint8_t, 0x1C> registers_{};
    uint8_t control_ = 0;       ///< the control register: where to read and write, and how to go on
    bool control_due_ = false;  ///< the next byte written is that
    uint8_t secret_ = 0;        ///< bytes of the reset call that came right; of another call: NONE
};

}  // namespace kilotwin

#endif
