/// The ATmega328P's two-wire interface (I2C) as the master of a bus with one device (datasheet,
/// chapter 22).
///
/// Stands in for simavr's, whose bits all take 1 us: here a step takes as long as TWBR and the
/// prescaler say. Not modelled: slave mode, lost arbitration, bus errors.
#ifndef KILOTWIN_AVR_BOARDS_TWI_MASTER_H
#define KILOTWIN_AVR_BOARDS_TWI_MASTER_H

#include <cstdint>

#include "avr/boards/pca9635.h"
#include "avr/chip/microcontroller.h"

namespace kilotwin {

/// One per module board, which passes on the events below.
class TwiMaster {
  public:
    /// Takes the interface's registers over from simavr. Both must live on.
    TwiMaster(Microcontroller &chip, Pca9635 &device);

    void control_written();  ///< TWCR was written
    void step_ends();        ///< the alarm TWO_WIRE
    void was_reset();        ///< the chip's registers are 0 again

  private:
    /// The step under way on the bus.
    enum class Step : uint8_t { NOTHING, START, ADDRESS, WRITE, READ, STOP };

    void begin(Step step, unsigned bits);  ///< for as long as so many bits take
    uint8_t control() const;               ///< TWCR

    Microcontroller &chip_;
    Pca9635 &device_;
    Step step_ = Step::NOTHING;
    bool owns_bus_ = false;   ///< from a start to the stop
    bool addressed_ = false;  ///< the address has been sent since
    bool reads_ = false;      ///< the address had the read bit
    bool starts_after_stop_ = false;
    uint8_t status_ = 0;  ///< status code in TWSR once the step is over
};

}  // namespace kilotwin

#endif
