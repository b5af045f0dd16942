#include "avr/call_watch.h"

#include <algorithm>

#include "base/errors.h"
#include "base/registers.h"

namespace kilotwin {

using namespace atmega328p;

CallWatch::CallWatch(const FlashImage &flash, RobotBoard &board)
    : flash_(flash),
      board_(board),
      which_(FLASH_BYTES / 2, NOT_WATCHED),
      heap_end_at_(flash.symbol("__brkval").value_or(0)) {
    const auto main = flash.symbol("main"), end = flash.symbol("_end");
    if (!main || !end)
        throw EngineError(flash.name() + " does not say where main() is; an .elf file does");
    main_ = *main;
    data_end_ = *end;
    board.follow(*this);
}

void CallWatch::watch(uint16_t entry) {
    which_.at(entry / 2) = static_cast<uint8_t>(calls_.size());
    calls_.push_back({entry});
}

/// Open calls are few: no deeper than watched functions call one another.
bool CallWatch::inside(uint16_t entry) const {
    return std::any_of(open_.begin(), open_.end(),
                       [&](const Open &open) { return calls_[open.which].entry == entry; });
}

/// Keeps a stack of open calls: one is open from its entry until the stack is above it again.
void CallWatch::executed(uint32_t from, uint32_t pc, uint16_t sp) {
    if (!in_main_ && pc != main_) return;
    in_main_ = true;
    // The stack pointer is written in two halves, high byte first; between them it is wrong.
    constexpr uint16_t OUT_MASK = 0xFE0F, OUT_SPH = 0xBE0E, OUT_SPL = 0xBE0D;
    const auto &code = flash_.bytes();
    const auto done = static_cast<uint16_t>(code[from] | code[from + 1] << 8);
    if ((done & OUT_MASK) == OUT_SPH) half_set_ = true;
    if ((done & OUT_MASK) == OUT_SPL) half_set_ = false;
    if (half_set_) return;

    if (!sums_.empty()) look_at_sum(from);
    // A call has returned once the stack is above its return address.
    while (!open_.empty() && sp > open_.back().sp) {
        const Open &open = open_.back();
        Call &call = calls_[open.which];
        const uint64_t cycles = board_.cycle() - open.since;
        if (cycles > call.longest) {
            call.longest = cycles;
            call.tick = open.tick;
        }
        open_.pop_back();
    }
    if (sp < least_sp_) record_stack(from, sp);
    if (pc == VECTOR_TIMER0_COMPA * VECTOR_BYTES) ticks_++;
    const uint8_t which = which_[pc / 2];
    if (which == NOT_WATCHED || inside(calls_[which].entry)) return;
    calls_[which].callers.try_emplace(static_cast<uint16_t>(from), board_.tick());
    calls_[which].calls++;
    open_.push_back({which, sp, board_.cycle(), board_.tick()});
}

void CallWatch::look_at_sum(uint32_t from) {
    const auto found = sums_.find(static_cast<uint16_t>(from));
    if (found == sums_.end() || found->second.tick != 0) return;
    if (board_.carry() == found->second.carry) found->second.tick = board_.tick();
}

/// Records a new deepest stack. The heap is read only here: it matters where the stack is deepest.
void CallWatch::record_stack(uint32_t from, uint16_t sp) {
    least_sp_ = sp;
    deepest_at_ = static_cast<uint16_t>(from);
    const auto heap_end =
        heap_end_at_ == 0
            ? 0
            : board_.read(heap_end_at_) | board_.read(static_cast<uint16_t>(heap_end_at_ + 1)) << 8;
    room_ = std::min(room_, sp + 1 - std::max<int32_t>(data_end_, heap_end));
}

}  // namespace kilotwin
