/// The ATmega328P's analog-to-digital converter, as far as a Kilobot can use it.
///
/// It stands in for simavr's, which converts when the result is read and cannot be started by the comparator:
/// a Kilobot measures distances by conversions that the pulses of a message start themselves (hardware.md 1.8).
#ifndef KILOTWIN_AVR_CHIP_CONVERTER_H
#define KILOTWIN_AVR_CHIP_CONVERTER_H

#include <cstdint>
#include <functional>

#include "avr/chip/microcontroller.h"

namespace kilotwin {

class Converter {
  public:
    /// What a channel (0..15, as in ADMUX) reads at this moment: 0..1023.
    using Sample = std::function<int16_t(uint8_t channel)>;

    Converter(Microcontroller &chip, Sample sample);

    // What its board passes on.
    void control_written();  ///< ADCSRA
    void conversion_ends();
    void flag_set(uint8_t vector);
    void quiet_sleep();  ///< begins: starts a conversion
    void was_reset();

  private:
    void start();
    uint8_t control() const;

    Microcontroller &chip_;
    Sample sample_;
    uint16_t result_ = 0;
    bool converting_ = false;
    bool first_ = true;  ///< since it was switched on: takes longer
};

}  // namespace kilotwin

#endif
