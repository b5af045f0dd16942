#include "engine/ideal_medium.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

/// Whether another one of those at `places` hides the sender from one of them.
bool IdealMedium::hidden(const Eigen::Vector2d &from, size_t listener,
                         const std::vector<Eigen::Vector2d> &places) const {
    const Eigen::Vector2d ray = places[listener] - from;
    double length_squared = ray.squaredNorm();
    double shadow = radius_m_ * radius_m_ * length_squared;
    for (size_t other = 0; other < places.size(); other++) {
        if (other == listener) continue;
        Eigen::Vector2d offset = places[other] - from;
        double along = offset.dot(ray);
        if (along <= 0 || along >= length_squared) continue;
        double across = offset.x() * ray.y() - offset.y() * ray.x();
        if (across * across < shadow) return true;
    }
    return false;
}

const std::vector<Listener> &
IdealMedium::find_audience(uint32_t sender, const Eigen::Vector2d &from, Neighbours::List around,
                           const std::vector<Eigen::Vector2d> &places) {
    auto &audience = audiences_[sender];
    audience.clear();
    for (size_t i = 0; i < places.size(); i++) {
        double distance_squared = (places[i] - from).squaredNorm();
        if (distance_squared > range_m_ * range_m_) continue;
        if (line_of_sight_ && hidden(from, i, places)) continue;
        double distance_mm =
            std::min(std::floor(std::sqrt(distance_squared) * 1000 + 0.5), 65535.0);
        audience.push_back({around.begin()[i], static_cast<uint16_t>(distance_mm)});
    }
    return audience;
}

}  // namespace kilotwin
