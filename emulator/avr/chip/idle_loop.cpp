#include "avr/chip/idle_loop.h"

#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include <algorithm>
#include <cstring>

namespace kilotwin {

namespace {

// Instructions a period may have. It is searched in stretches that double, so that instructions
// ahead of the loop do no harm (Brent's algorithm).
constexpr int FIRST_STRETCH = 32, LONGEST_STRETCH = 512;
// A search does not pay for fewer cycles than this, interpreted and translated.
constexpr uint64_t WORTHWHILE = 256, WORTHWHILE_TRANSLATED = 512;
// Translated code counts down by arithmetic itself: for so long it is left to do so, as between
// the pulses of a frame that it sends.
constexpr uint64_t COUNTDOWNS = 8192;
constexpr uint64_t LEAST_PATIENCE = 512, MOST_PATIENCE = 524'288;
// So many times the last period, something may still go on that is not the wait itself.
constexpr int MOST_TRIES = 6;

uint16_t word_at(const avr_t *avr, uint32_t pc) {
    pc &= avr->flashend;
    return static_cast<uint16_t>(avr->flash[pc] | avr->flash[(pc + 1) & avr->flashend] << 8);
}

/// A loop that counts registers down to 0 and does nothing else, as avr-gcc compiles delays.
struct Countdown {
    std::array<unsigned, 4> registers{};  ///< of the counter, lowest byte first
    unsigned bytes = 0;                   ///< of the counter; 0: there is no such loop
    uint64_t cycles = 0;                  ///< of one pass
};

/// The countdown that begins at `pc`: dec, or sbiw, or subi and some sbci, then a brne back to it.
Countdown countdown_at(const avr_t *avr, uint32_t pc) {
    const uint16_t head = word_at(avr, pc);
    Countdown loop;
    unsigned words = 1;
    auto count_in = [&loop](unsigned where) { loop.registers[loop.bytes++] = where; };
    auto immediate_register = [](uint16_t op) { return 16u + (op >> 4 & 15u); };
    if ((head & 0xFE0F) == 0x940A) {  // dec
        count_in(head >> 4 & 31u);
        loop.cycles = 3;
    } else if ((head & 0xFFCF) == 0x9701) {  // sbiw by 1
        count_in(24 + 2 * (head >> 4 & 3u));
        count_in(loop.registers[0] + 1);
        loop.cycles = 4;
    } else if ((head & 0xFF0F) == 0x5001) {  // subi by 1
        count_in(immediate_register(head));
        loop.cycles = 3;
        for (uint16_t next; ((next = word_at(avr, pc + 2 * words)) & 0xFF0F) == 0x4000; words++) {
            if (loop.bytes == loop.registers.size()) return {};
            count_in(immediate_register(next));  // sbci by 0
            loop.cycles++;
        }
    } else {
        return {};
    }
    const uint16_t brne = static_cast<uint16_t>(0xF401 | (-(words + 1) & 0x7F) << 3);
    return word_at(avr, pc + 2 * words) == brne ? loop : Countdown{};
}

/// Whether the chip's code is executed otherwise than by simavr's interpreter.
bool is_translated(const avr_t *avr) { return avr->run != avr_callback_run_raw; }

}  // namespace

IdleLoop::IdleLoop(avr_t *avr) : avr_(avr), quiet_(avr), memory_(avr->ramend + 1u) {}

uint64_t IdleLoop::next_event() const {
    const auto *slot = avr_->cycle_timers.timer;
    return slot != nullptr ? slot->when : UINT64_MAX;
}

bool IdleLoop::can_wait() const {
    return avr_->state == cpu_Running && avr_->interrupt_state == 0 &&
           avr_has_pending_interrupts(avr_) == 0 && avr_->gdb == nullptr;
}

bool IdleLoop::pass(uint64_t until) {
    if (!can_wait()) return false;
    if (period_ == 0) {
        const uint64_t limit = std::min(until, next_event());
        const uint64_t least = is_translated(avr_) ? WORTHWHILE_TRANSLATED : WORTHWHILE;
        if (avr_->cycle < not_before_ || avr_->cycle + least > limit) return false;
        if (!repeats_last(until) && (asleep_ || !find(until))) {
            patience_ = std::clamp(2 * patience_, LEAST_PATIENCE, MOST_PATIENCE);
            not_before_ = avr_->cycle + patience_;
            return false;
        }
        patience_ = 0;
        if (period_ == 0) {  // a countdown was shortened instead
            if (is_translated(avr_)) not_before_ = avr_->cycle + COUNTDOWNS;
            return false;
        }
    }
    const uint64_t event = quiet_.next_event();
    // One cycle short of an event: simavr processes events behind an instruction, not before one.
    const uint64_t last = std::min(until, event - 1);
    if (avr_->cycle < last) avr_->cycle += (last - avr_->cycle) / period_ * period_;
    if (next_event() <= avr_->cycle) avr_cycle_timer_process(avr_);
    return until < event;
}

/// Whether the chip is in a wait of the same length as the one before, which is then its period.
bool IdleLoop::repeats_last(uint64_t until) {
    if (last_period_ == 0) return false;
    for (int tries = 0; tries < MOST_TRIES; tries++) {
        const uint64_t end = avr_->cycle + last_period_;
        // Else an event would come in between, or the program would leave the flash.
        if (end >= std::min(until, next_event()) || avr_->state != cpu_Running ||
            avr_->interrupt_state != 0 || avr_->pc > avr_->flashend)
            return false;
        keep_state();
        active_ = false;
        avr_->run_cycle_count = last_period_;
        const int state = avr_run(avr_);
        asleep_ = state == cpu_Sleeping;
        if (state != cpu_Running || avr_has_pending_interrupts(avr_) != 0) return false;
        if (active_ || avr_->cycle != end || avr_->pc != pc_ || !same_state()) continue;
        period_ = last_period_;
        return true;
    }
    return false;
}

/// Executes instructions until a state repeats, which gives the period, or until a countdown
/// begins, which is shortened. False if neither comes within the longest stretch.
bool IdleLoop::find(uint64_t until) {
    for (int stretch = FIRST_STRETCH; stretch <= LONGEST_STRETCH; stretch *= 2) {
        // simavr delays interrupts by an instruction after they were enabled.
        while (avr_->interrupt_state < 0)
            if (!step() || avr_->cycle >= until) return false;
        keep_state();
        const uint64_t from = avr_->cycle;
        active_ = false;
        for (int i = 0; i < stretch; i++) {
            if (count_down(std::min(until, next_event()))) return true;
            if (!step() || avr_->cycle >= until) return false;
            if (active_) break;
            if (avr_->pc == pc_ && same_state()) {
                period_ = last_period_ = avr_->cycle - from;
                return true;
            }
        }
    }
    return false;
}

/// Executes one instruction; false if the chip then no longer just runs on. Sleeping and leaving
/// the flash are left to Microcontroller::run().
bool IdleLoop::step() {
    constexpr uint16_t SLEEP = 0x9588;
    if (avr_->pc > avr_->flashend || word_at(avr_, avr_->pc) == SLEEP) return false;
    avr_->run_cycle_count = 1;
    return avr_run(avr_) == cpu_Running && avr_has_pending_interrupts(avr_) == 0;
}

void IdleLoop::keep_state() {
    pc_ = avr_->pc;
    interrupt_state_ = avr_->interrupt_state;
    std::copy_n(avr_->data, memory_.size(), memory_.begin());
    std::copy_n(avr_->sreg, flags_.size(), flags_.begin());
    timers_.clear();
    for (auto *slot = avr_->cycle_timers.timer; slot != nullptr; slot = slot->next)
        timers_.push_back(slot->when);
}

bool IdleLoop::same_state() const {
    if (avr_->interrupt_state != interrupt_state_ ||
        std::memcmp(avr_->data, memory_.data(), memory_.size()) != 0 ||
        std::memcmp(avr_->sreg, flags_.data(), flags_.size()) != 0)
        return false;
    auto kept = timers_.begin();
    for (auto *slot = avr_->cycle_timers.timer; slot != nullptr; slot = slot->next, ++kept)
        if (kept == timers_.end() || *kept != slot->when) return false;
    return kept == timers_.end();
}

/// Shortens a countdown that begins here, by all passes before `limit` but the last two, which set
/// the flags as they would be. False if there is none, or nothing to gain.
bool IdleLoop::count_down(uint64_t limit) {
    const Countdown loop = countdown_at(avr_, avr_->pc);
    if (loop.bytes == 0) return false;
    uint64_t count = 0;
    for (unsigned i = 0; i < loop.bytes; i++)
        count |= static_cast<uint64_t>(avr_->data[loop.registers[i]]) << 8 * i;
    if (count == 0) count = uint64_t{1} << 8 * loop.bytes;  // 0 wraps all the way round
    const uint64_t room = limit > avr_->cycle ? (limit - avr_->cycle) / loop.cycles : 0;
    const uint64_t passes = std::min(count, room);
    if (passes <= 2) return false;
    count -= passes - 2;
    avr_->cycle += (passes - 2) * loop.cycles;
    for (unsigned i = 0; i < loop.bytes; i++)
        avr_->data[loop.registers[i]] = static_cast<uint8_t>(count >> 8 * i);
    return true;
}

}  // namespace kilotwin
