/// Skips the time in which a program only waits.
///
/// A Kilobot's firmware never sleeps while it runs: it counts down delays, or polls until an
/// interrupt changes something. Both are predictable. A countdown is shortened by arithmetic; and
/// once the chip is back in exactly the state it was in before, with no effect outside in between,
/// it repeats that period until the next event. The result is the same to the cycle:
/// tests/native/avr compares it with Microcontroller::skip_nothing().
#ifndef KILOTWIN_AVR_CHIP_IDLE_LOOP_H
#define KILOTWIN_AVR_CHIP_IDLE_LOOP_H

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "avr/chip/quiet_timers.h"

struct avr_t;

namespace kilotwin {

class IdleLoop {
  public:
    /// `avr` must live on.
    explicit IdleLoop(avr_t *avr);

    /// To be called when the program acts on something outside its registers and memory, or reads a
    /// register that changes by itself: the present period is not idle.
    void note_activity() { active_ = true; }

    /// Moves the chip towards `until` (cycles) while it provably has no observable effect; a search
    /// executes instructions. True: it idles beyond `until` and need not be run at all; its cycle
    /// may stay up to one period behind. False: the caller executes on from where the chip is now.
    ///
    /// Costs a few comparisons once a period is known. A program mostly waits in one loop, so the
    /// period found last is tried first, which costs some periods and copies of SRAM; then a search
    /// costs up to 1,000 instructions one by one. After one that failed, the next waits twice as
    /// long, up to 524,288 cycles.
    bool pass(uint64_t until);

    /// The cycle of the event that ends the present wait, UINT64_MAX: none does; 0 while none is
    /// known.
    uint64_t end() const { return period_ != 0 && can_wait() ? quiet_.next_event() : 0; }

    /// Whether the program went to sleep within pass(), which the caller has to attend to; once.
    bool fell_asleep() { return std::exchange(asleep_, false); }

    /// To be called after the chip was run, or its registers changed: the period found may not
    /// hold.
    void forget() { period_ = 0; }

  private:
    bool repeats_last(uint64_t until);
    bool find(uint64_t until);
    bool same_state() const;
    void keep_state();
    bool step();
    bool count_down(uint64_t limit);
    bool can_wait() const;
    uint64_t next_event() const;

    avr_t *avr_;
    QuietTimers quiet_;
    bool active_ = false;
    bool asleep_ = false;
    uint64_t last_period_ = 0;  ///< the one found last; 0: none so far
    uint64_t period_ = 0;       ///< cycles after which the state is the same again; 0: not known
    uint64_t not_before_ = 0;   ///< cycle before which no search begins
    uint64_t patience_ = 0;     ///< cycles from a failed search to the next; doubles with each

    // The state that is waited for.
    uint32_t pc_ = 0;
    int8_t interrupt_state_ = 0;  ///< simavr's delay after interrupts were enabled
    std::vector<uint8_t> memory_;
    std::array<uint8_t, 8> flags_{};
    std::vector<uint64_t> timers_;
};

}  // namespace kilotwin

#endif
