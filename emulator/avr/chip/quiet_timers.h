/// Finds the first event of a chip's clocks that may change anything.
///
/// A timer that runs freely overflows and matches all the time, also while its interrupts are off
/// and its flags are up already: such events change nothing, and a wait goes on over them. simavr
/// may process them late, all at once.
#ifndef KILOTWIN_AVR_CHIP_QUIET_TIMERS_H
#define KILOTWIN_AVR_CHIP_QUIET_TIMERS_H

#include <array>
#include <cstdint>

struct avr_t;
struct avr_timer_t;
struct avr_int_vector_t;

namespace kilotwin {

class QuietTimers {
  public:
    /// `avr` must live on.
    explicit QuietTimers(avr_t *avr);

    /// The cycle of the first event that may change a register, raise an interrupt, move a pin or
    /// start a conversion, if the program writes no register until then; UINT64_MAX: there is none.
    uint64_t next_event() const;

  private:
    bool is_quiet(const avr_int_vector_t &vector) const;
    bool is_quiet(const avr_timer_t &timer, unsigned match) const;
    bool match_is_quiet(const avr_timer_t &timer, uint64_t cycles) const;
    uint64_t loud_from(const avr_timer_t &timer, uint64_t when) const;

    avr_t *avr_;
    std::array<const avr_timer_t *, 3> timers_{};
};

}  // namespace kilotwin

#endif
