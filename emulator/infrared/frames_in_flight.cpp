#include "infrared/frames_in_flight.h"

#include <algorithm>
#include <utility>

namespace kilotwin {

// A lane has at most SOME frames more than were on air in it at a time.
FramesInFlight::FramesInFlight(size_t stations, uint32_t lanes)
    : stations_(stations),
      messages_(stations),
      free_(lanes) {
    if (lanes > 1) frames_.reserve(stations + lanes * SOME);
}

Frame &FramesInFlight::put_on_air(uint32_t sender, Cycles at, double range_m,
                                  const message_t &message, uint32_t lane) {
    auto &free = free_[lane].indices;
    if (free.empty()) fetch_free(free);
    stations_[sender].frame = free.back();
    free.pop_back();
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

void FramesInFlight::fetch_free(std::vector<uint32_t> &free) {
    const std::lock_guard<std::mutex> lock(fetching_);
    for (size_t i = 0; i < SOME; i++) {
        if (spare_.empty()) {
            spare_.push_back(static_cast<uint32_t>(frames_.size()));
            frames_.emplace_back();
        }
        free.push_back(spare_.back());
        spare_.pop_back();
    }
}

void FramesInFlight::share_free() {
    for (Free &free : free_) {
        spare_.insert(spare_.end(), free.indices.begin(), free.indices.end());
        free.indices.clear();
    }
}

void FramesInFlight::take_off_air(const Frame &frame, uint32_t lane) {
    const uint32_t index = std::exchange(stations_[frame.sender].frame, NONE);
    free_[lane].indices.push_back(index);
    for (const Reached &reached : frame.reached) {
        auto &audible = stations_[reached.station].audible;
        *std::find(audible.begin(), audible.end(), index) = audible.back();
        audible.pop_back();
    }
}

}  // namespace kilotwin
