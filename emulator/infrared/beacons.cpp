#include "infrared/beacons.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

Beacons::Beacons(const std::vector<BeaconDef> &beacons, double range_m, const Bodies &bodies,
                 const Chance &chance)
    : range_m_(range_m),
      bodies_(bodies),
      chance_(chance) {
    for (const BeaconDef &def : beacons) beacons_.push_back({def, NEVER});
}

// No light before: robots are switched on at their own moments.
void Beacons::boot(Cycles until) {
    for (auto &[def, next] : beacons_) {
        const double share = chance_.uniform(def.object, Purpose::BEACON, 0);
        next = until + static_cast<Cycles>(share * static_cast<double>(def.period));
    }
}

Cycles Beacons::next_light() const {
    Cycles first = NEVER;
    for (const Beacon &beacon : beacons_) first = std::min(first, beacon.next);
    return first;
}

Beacons::Beacon *Beacons::due(Cycles until) {
    auto first = std::min_element(beacons_.begin(), beacons_.end(),
                                  [](const auto &a, const auto &b) { return a.next < b.next; });
    return first != beacons_.end() && first->next < until ? &*first : nullptr;
}

// A robot or an object may come nearer meanwhile, by far less than the range.
bool Beacons::begins_near(uint32_t robot, Cycles until) const {
    for (uint32_t i = 0; i < beacons_.size(); i++)
        if (beacons_[i].next <= until &&
            (bodies_.position(robot) - place(i)).norm() <= 2 * range_m_)
            return true;
    return false;
}

bool IdealBeacons::run(Cycles /*turn*/, Cycles next) {
    Beacon *beacon = due(next);
    if (beacon == nullptr) return false;
    const auto index = static_cast<uint32_t>(beacon - beacons_.data());
    for_each_receiver(index, [&](uint32_t robot, double distance_m) {
        const auto mm = static_cast<int16_t>(std::lround(std::min(distance_m * 1000, 32767.0)));
        channel_.deliver(robot, {Trail::Kind::BEACON, index}, beacon->next, beacon->def.message,
                         mm);
    });
    beacon->next += beacon->def.period;
    return true;
}

// One that receives does not try: a frame's later pulses are none that carrier sense looks for.
bool KilobotBeacons::run(Cycles turn, Cycles next) {
    Beacon *beacon = due(std::min(turn + 1, next));
    if (beacon == nullptr) return false;
    const auto station = first_ + static_cast<uint32_t>(beacon - beacons_.data());
    const Cycles at = beacon->next;
    if (!channel_.in_flight().is_dark(station)) {
        beacon->next += TICK_CYCLES;
        return true;
    }
    beacon->next += beacon->def.period;
    channel_.begin_frame(station, at, beacon->def.message, false);
    return true;
}

void KilobotBeacons::shine(Frame &frame) {
    for_each_receiver(frame.sender - first_, [&](uint32_t robot, double distance_m) {
        channel_.shine_on_robot(frame, robot, distance_m);
    });
}

void KilobotBeacons::shine_from_robot(Frame &frame, const Eigen::Vector2d &from) {
    for (uint32_t i = 0; i < beacons_.size(); i++) {
        const Eigen::Vector2d here = place(i);
        const double distance_m = (here - from).norm();
        if (distance_m <= frame.range_m && bodies_.arena().lets_light_pass(here, from))
            channel_.in_flight().reach(
                frame, {first_ + i, static_cast<float>(distance_m * 1000), Fate::CLEAR});
    }
}

void KilobotBeacons::gave_up(const Frame &frame) {
    Beacon &beacon = beacons_[frame.sender - first_];
    beacon.next = std::min(beacon.next, frame.begin + TICK_CYCLES);
    channel_.tally().attempts_failed++;
}

void KilobotBeacons::sent(const Frame & /*frame*/) { channel_.tally().sent++; }

}  // namespace kilotwin
