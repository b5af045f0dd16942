/// The ATmega328P's analog-to-digital converter (datasheet, chapter 24).
///
/// Stands in for simavr's, which converts when the result is read and cannot be triggered by the
/// comparator: a Kilobot measures distances by conversions that the pulses of a message start
/// (hardware.md 1.8). Modelled: single, triggered and free-running conversions with their
/// durations, all trigger sources, left adjustment, the flag and its interrupt, starting by
/// noise-reduction sleep. Not modelled: the latch of ADCL and ADCH, reference selection.
#ifndef KILOTWIN_AVR_CHIP_CONVERTER_H
#define KILOTWIN_AVR_CHIP_CONVERTER_H

#include <cstdint>
#include <functional>

#include "avr/chip/microcontroller.h"

namespace kilotwin {

/// One per board. Its board passes on the events below, each at the cycle at which it happens.
class Converter {
  public:
    /// The reading of a channel (0..15, as in ADMUX) at this moment; clamped to 0..1023.
    using Sample = std::function<int16_t(uint8_t channel)>;

    /// Takes the converter's registers over from simavr. `chip` must live on; `sample` is called
    /// once for each conversion, at its start.
    Converter(Microcontroller &chip, Sample sample);

    void control_written();         ///< ADCSRA was written
    void conversion_ends();         ///< the alarm CONVERSION
    void flag_set(uint8_t vector);  ///< an interrupt flag went up that may be the trigger
    void quiet_sleep();             ///< noise-reduction sleep begins, which starts a conversion
    void was_reset();               ///< the chip's registers are 0 again

  private:
    void start();
    uint8_t control() const;

    Microcontroller &chip_;
    Sample sample_;
    uint16_t result_ = 0;  ///< of the conversion under way, 0..1023
    bool converting_ = false;
    bool first_ = true;  ///< the next one is the first since it was switched on: longer
};

}  // namespace kilotwin

#endif
