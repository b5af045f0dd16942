#include "infrared/receivers_in_range.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

/// Whether another one hides the sender from one of those around.
bool ReceiversInRange::hidden(const Scratch &scratch, const Eigen::Vector2d &from, size_t receiver,
                              size_t others) const {
    const auto &places = scratch.places;
    const Eigen::Vector2d ray = places[receiver] - from;
    double length_squared = ray.squaredNorm();
    double shadow = radius_m_ * radius_m_ * length_squared;
    for (size_t other = 0; other < others; other++) {
        if (other == receiver) continue;
        Eigen::Vector2d offset = places[other] - from;
        double along = offset.dot(ray);
        if (along <= 0 || along >= length_squared) continue;
        double across = offset.x() * ray.y() - offset.y() * ray.x();
        if (across * across < shadow) return true;
    }
    return false;
}

void ReceiversInRange::choose(std::vector<Receiver> &receivers, const Scratch &scratch,
                              const Eigen::Vector2d &from, Neighbours::List around,
                              size_t in_range) const {
    receivers.clear();
    const bool walls = !arena_.is_open();
    for (size_t i = 0; i < in_range; i++) {
        const auto [place, distance_squared] = scratch.in_range[i];
        if (line_of_sight_ && hidden(scratch, from, place, around.size())) continue;
        if (walls && !arena_.lets_light_pass(from, scratch.places[place])) continue;
        const double distance_mm = std::min(std::sqrt(distance_squared) * 1000 + 0.5, 65535.0);
        receivers.push_back({around.begin()[place], static_cast<uint16_t>(distance_mm)});
    }
}

}  // namespace kilotwin
