/// Passes over the time in which a program only waits.
///
/// A Kilobot's firmware never sleeps while it runs: it counts down delays, or goes round and round until an interrupt
/// changes something. Both can be foreseen: when the chip comes back to the very state it was in before, it
/// goes on doing so until the next event. The result is the same to the cycle; a test compares the two.
#ifndef KILOTWIN_AVR_CHIP_IDLE_LOOP_H
#define KILOTWIN_AVR_CHIP_IDLE_LOOP_H

#include <array>
#include <cstdint>
#include <vector>

struct avr_t;

namespace kilotwin {

class IdleLoop {
  public:
    explicit IdleLoop(avr_t *avr);

    /// The chip did something that shows outside, or read what changes by itself: it does not only wait.
    void note_activity() { active_ = true; }

    /// Moves the chip on towards `until`, as far as it is sure to do nothing that shows. True: it waits in a loop
    /// beyond `until` and need not be run at all; its cycle may stay a little behind.
    bool pass(uint64_t until);

    /// The chip was run, so what was found may no longer hold.
    void forget() { period_ = 0; }

  private:
    bool find(uint64_t until);
    bool same_state() const;
    void keep_state();
    bool step();
    bool count_down(uint64_t limit);
    uint64_t next_event() const;

    avr_t *avr_;
    bool active_ = false;
    uint64_t period_ = 0;  ///< cycles after which it is where it is now; 0: not known
    uint64_t not_before_ = 0;
    uint64_t patience_ = 0;  ///< cycles until the next search, if it has just failed

    // The state that is to come back.
    uint32_t pc_ = 0;
    int8_t interrupt_state_ = 0;  ///< simavr's wait after interrupts were enabled
    std::vector<uint8_t> memory_;
    std::array<uint8_t, 8> flags_{};
    std::vector<uint64_t> timers_;
};

}  // namespace kilotwin

#endif
