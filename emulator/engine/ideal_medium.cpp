#include "engine/ideal_medium.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

bool IdealMedium::hidden(uint32_t sender, uint32_t listener, Neighbours::List around,
                         const std::vector<Eigen::Vector2d> &positions) const {
    const Eigen::Vector2d from = positions[sender], ray = positions[listener] - from;
    double length_squared = ray.squaredNorm();
    double shadow = radius_m_ * radius_m_ * length_squared;
    for (uint32_t other : around) {
        if (other == listener) continue;
        Eigen::Vector2d offset = positions[other] - from;
        double along = offset.dot(ray);
        if (along <= 0 || along >= length_squared) continue;
        double across = offset.x() * ray.y() - offset.y() * ray.x();
        if (across * across < shadow) return true;
    }
    return false;
}

const std::vector<Listener> &
IdealMedium::find_audience(uint32_t sender, Neighbours::List around,
                           const std::vector<Eigen::Vector2d> &positions) {
    auto &audience = audiences_[sender];
    audience.clear();
    for (uint32_t other : around) {
        double distance_squared = (positions[other] - positions[sender]).squaredNorm();
        if (distance_squared > range_m_ * range_m_) continue;
        if (line_of_sight_ && hidden(sender, other, around, positions)) continue;
        double distance_mm =
            std::min(std::floor(std::sqrt(distance_squared) * 1000 + 0.5), 65535.0);
        audience.push_back({other, static_cast<uint16_t>(distance_mm)});
    }
    return audience;
}

}  // namespace kilotwin
