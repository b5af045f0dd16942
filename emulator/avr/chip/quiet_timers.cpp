#include "avr/chip/quiet_timers.h"

#include <simavr/avr_timer.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>

#include <algorithm>
#include <cstring>

#include "base/registers.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// simavr leaves out a match that lies less far behind an overflow than the instruction that this
// comes in.
constexpr uint64_t LONGEST_INSTRUCTION = 16;

}  // namespace

QuietTimers::QuietTimers(avr_t *avr) : avr_(avr) {
    size_t found = 0;
    for (const avr_io_t *part = avr->io_port; part != nullptr; part = part->next)
        if (std::strcmp(part->kind, "timer") == 0 && found < timers_.size())
            timers_[found++] = reinterpret_cast<const avr_timer_t *>(part);
}

/// Whether the flag's going up changes nothing.
bool QuietTimers::is_quiet(const avr_int_vector_t &vector) const {
    return vector.raised.reg != 0 && avr_regbit_get(avr_, vector.raised) != 0 &&
           avr_regbit_get(avr_, vector.enable) == 0 && vector.pending == 0;
}

bool QuietTimers::is_quiet(const avr_timer_t &timer, unsigned match) const {
    return avr_regbit_get(avr_, timer.comp[match].com) == avr_timer_com_normal &&
           is_quiet(timer.comp[match].interrupt);
}

/// Whether all matches are quiet that come so many cycles behind an overflow. False if none does.
bool QuietTimers::match_is_quiet(const avr_timer_t &timer, uint64_t cycles) const {
    bool found = false;
    for (unsigned match = 0; match < AVR_TIMER_COMP_COUNT; match++) {
        if (cycles != timer.comp[match].comp_cycles) continue;
        if (!is_quiet(timer, match)) return false;
        found = true;
    }
    return found;
}

/// When an event comes with the overflow at `when`, or with a match behind it, that is not quiet.
uint64_t QuietTimers::loud_from(const avr_timer_t &timer, uint64_t when) const {
    if (!is_quiet(timer.overflow)) return when;
    uint64_t first = UINT64_MAX;
    for (unsigned match = 0; match < AVR_TIMER_COMP_COUNT; match++) {
        const uint64_t cycles = timer.comp[match].comp_cycles;
        if (cycles == 0 || cycles > timer.tov_cycles || is_quiet(timer, match)) continue;
        const bool moves_pin = avr_regbit_get(avr_, timer.comp[match].com) != avr_timer_com_normal;
        const bool at_once =
            moves_pin || cycles == timer.tov_cycles || cycles < LONGEST_INSTRUCTION;
        first = std::min(first, at_once ? when : when + cycles);
    }
    return first;
}

uint64_t QuietTimers::next_event() const {
    constexpr uint8_t TRIGGERED = ADCSRA_ADEN | ADCSRA_ADATE, FIRST_TIMER_TRIGGER = 3;
    const bool converts = (avr_->data[ADCSRA] & TRIGGERED) == TRIGGERED &&
                          (avr_->data[ADCSRB] & ADCSRB_ADTS) >= FIRST_TIMER_TRIGGER;
    uint64_t next = UINT64_MAX;
    for (const auto *slot = avr_->cycle_timers.timer; slot != nullptr; slot = slot->next) {
        if (slot->when >= next) break;  // they are in order of time
        const auto *timer = std::find(timers_.begin(), timers_.end(), slot->param);
        uint64_t loud = slot->when;
        if (timer != timers_.end() && !converts && (*timer)->ext_clock_flags == 0) {
            const uint64_t round = slot->when - (*timer)->tov_base;
            if (round == (*timer)->tov_cycles) {
                loud = loud_from(**timer, slot->when);
            } else {
                if (match_is_quiet(**timer, round)) loud = UINT64_MAX;
            }
        }
        next = std::min(next, loud);
    }
    return next;
}

}  // namespace kilotwin
