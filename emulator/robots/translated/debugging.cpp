#include "robots/translated/debugging.h"

#include <algorithm>
#include <cstring>

namespace kilotwin {

namespace {

// So long before a wanted place each pass is executed: longer than from one tick to the next, up to
// which passes are left out at once.
constexpr uint64_t NEAR_CYCLES = 2 * TICK_CYCLES;

}  // namespace

void Debugging::want(const Wanted &wanted) {
    wanted_ = wanted;
    std::fill(breaks_at_.begin(), breaks_at_.end(), uint8_t{0});
    for (const uint32_t address : wanted.breakpoints)
        breaks_at_[address / 2 % breaks_at_.size()] = 1;
    for (Held &held : held_) held.knows = false;
    last_.reset();
}

uint64_t Debugging::executes_from(uint32_t robot) const {
    if (!wanted_.until || wanted_.until->robot != robot) return NO_PLACE;
    return wanted_.until->cycle - std::min(wanted_.until->cycle, NEAR_CYCLES);
}

Debugging::Why Debugging::change_of(Held &held, const Instruction &now, uint32_t &watch) const {
    if (!held.knows) return Why::NOTHING;
    if (wanted_.colour && now.colour == *wanted_.colour && held.colour != now.colour)
        return Why::COLOUR;
    const uint8_t *was = held.bytes.data();
    for (watch = 0; watch < wanted_.watches.size(); watch++) {
        const Watch &one = wanted_.watches[watch];
        if (std::memcmp(was, now.data + one.address, one.bytes) != 0) return Why::WATCH;
        was += one.bytes;
    }
    return Why::NOTHING;
}

void Debugging::remember(Held &held, const Instruction &now) const {
    held.knows = true;
    held.colour = now.colour;
    held.cycle = now.place.cycle;
    held.pc = now.pc;
    held.bytes.clear();
    for (const Watch &one : wanted_.watches)
        held.bytes.insert(held.bytes.end(), now.data + one.address,
                          now.data + one.address + one.bytes);
}

bool Debugging::look(const Instruction &now) {
    Held &held = held_[now.place.robot];
    // The code may hand an instruction over that it has begun with.
    if (held.cycle == now.place.cycle && held.pc == now.pc) return false;
    uint32_t watch = 0;
    const Place before = {now.place.robot, held.cycle};
    const Why change = change_of(held, now, watch);
    remember(held, now);
    if (change != Why::NOTHING) last_ = {before, change, watch};
    const auto &until = wanted_.until;
    if (until && until->robot == now.place.robot && until->cycle <= now.place.cycle) {
        stop(now, Why::PLACE, 0, before.cycle);
        return true;
    }
    Why why = change;
    if (why == Why::NOTHING) {
        if (breaks_at_[now.pc / 2 % breaks_at_.size()] != 0)
            why = Why::BREAKPOINT;
        else if (wanted_.message && now.begins_callback)
            why = Why::MESSAGE;
        else if (wanted_.step)
            why = Why::STEP;
        if (why != Why::NOTHING) last_ = {now.place, why, 0};
    }
    if (why == Why::NOTHING) return false;
    if (!wanted_.only_notes) stop(now, why, watch, before.cycle);
    return true;
}

void Debugging::look_behind(const Instruction &now) {
    Held &held = held_[now.place.robot];
    uint32_t watch = 0;
    const Why change = change_of(held, now, watch);
    if (change != Why::NOTHING) last_ = {{now.place.robot, held.cycle}, change, watch};
}

void Debugging::failed(const Instruction &now) {
    last_ = {now.place, Why::CRASH, 0};
    if (!wanted_.only_notes) stop(now, Why::CRASH, 0, held_[now.place.robot].cycle);
}

void Debugging::stop(const Instruction &now, Why why, uint32_t watch, uint64_t before) {
    standing_ = {now.place, now.pc, why, watch, before};
    on_stop_(*standing_);
    standing_.reset();
    remember(held_[now.place.robot], now);  // other watches may be wanted now
}

}  // namespace kilotwin
