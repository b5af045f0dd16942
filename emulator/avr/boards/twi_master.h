/// The ATmega328P's two-wire interface as a master of one bus with one device (datasheet, chapter 22).
///
/// It stands in for simavr's, whose bits all take 1 us.
#ifndef KILOTWIN_AVR_BOARDS_TWI_MASTER_H
#define KILOTWIN_AVR_BOARDS_TWI_MASTER_H

#include <cstdint>

#include "avr/boards/pca9635.h"
#include "avr/chip/microcontroller.h"

namespace kilotwin {

class TwiMaster {
  public:
    TwiMaster(Microcontroller &chip, Pca9635 &device);

    // What its board passes on.
    void control_written();  ///< TWCR
    void step_ends();
    void was_reset();

  private:
    enum class Step : uint8_t { NOTHING, START, ADDRESS, WRITE, READ, STOP };

    void begin(Step step, unsigned bits);
    uint8_t control() const;

    Microcontroller &chip_;
    Pca9635 &device_;
    Step step_ = Step::NOTHING;
    bool owns_bus_ = false, addressed_ = false, reads_ = false;
    bool starts_after_stop_ = false;
    uint8_t status_ = 0;  ///< what TWSR will say when the step is over
};

}  // namespace kilotwin

#endif
