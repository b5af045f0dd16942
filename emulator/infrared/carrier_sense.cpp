#include "infrared/carrier_sense.h"

#include <algorithm>

namespace kilotwin {

namespace {

// A pulse is noticed so long after it begins: its own length and the interrupt's entry.
constexpr Cycles NOTICE_CYCLES = 72;
constexpr Cycles LEADER_STOP = STOP_SLOT * SLOT_CYCLES;

}  // namespace

bool CarrierSense::finds_busy(const Frame &frame) const {
    if (held_busy_) return true;
    if (!senses_) return false;
    const Cycles first = frame.begin + WINDOW_BEGIN, last = frame.begin + WINDOW_END;
    auto polled = [&](Cycles pulse) { return pulse >= first && pulse < last; };
    const auto &audible = frames_.station(frame.listener).audible;
    return std::any_of(audible.begin(), audible.end(), [&](uint32_t other) {
        return polled(frames_[other].begin) || polled(frames_[other].begin + LEADER_STOP);
    });
}

bool CarrierSense::is_receiving(uint32_t station, Cycles at) const {
    const auto &audible = frames_.station(station).audible;
    return std::any_of(audible.begin(), audible.end(),
                       [&](uint32_t frame) { return frames_[frame].begin + NOTICE_CYCLES <= at; });
}

}  // namespace kilotwin
