#include "infrared/frames_in_flight.h"

#include <algorithm>
#include <utility>

namespace kilotwin {

Frame &FramesInFlight::put_on_air(uint32_t sender, Cycles at, double range_m,
                                  const message_t &message) {
    if (free_.empty()) {
        free_.push_back(static_cast<uint32_t>(frames_.size()));
        frames_.emplace_back();
    }
    stations_[sender].frame = free_.back();
    free_.pop_back();
    Frame &frame = of(sender);
    frame.begin = at;
    frame.range_m = range_m;
    frame.sender = frame.listener = sender;
    frame.granted = frame.has_orders = false;
    frame.above = 0;
    frame.message = &messages_[sender];
    frame.reached.clear();
    messages_[sender].say(message);
    return frame;
}

void FramesInFlight::spoil(uint32_t station) {
    for (uint32_t index : stations_[station].audible)
        for (Reached &reached : frames_[index].reached)
            if (reached.station == station && reached.fate == Fate::CLEAR)
                reached.fate = Fate::COLLIDED;
}

void FramesInFlight::deafen(uint32_t station) {
    for (uint32_t index : stations_[station].audible)
        for (Reached &reached : frames_[index].reached)
            if (reached.station == station) reached.fate = Fate::DEAF;
}

void FramesInFlight::take_off_air(const Frame &frame) {
    const uint32_t index = std::exchange(stations_[frame.sender].frame, NONE);
    free_.push_back(index);
    for (const Reached &reached : frame.reached) {
        auto &audible = stations_[reached.station].audible;
        *std::find(audible.begin(), audible.end(), index) = audible.back();
        audible.pop_back();
    }
}

}  // namespace kilotwin
