#include "engine/ideal_medium.h"

namespace kilotwin {

/// Whether another one hides the sender from one of those around.
bool IdealMedium::hidden(const Eigen::Vector2d &from, size_t listener) const {
    const Eigen::Vector2d ray = places_[listener] - from;
    double length_squared = ray.squaredNorm();
    double shadow = radius_m_ * radius_m_ * length_squared;
    for (size_t other = 0; other < places_.size(); other++) {
        if (other == listener) continue;
        Eigen::Vector2d offset = places_[other] - from;
        double along = offset.dot(ray);
        if (along <= 0 || along >= length_squared) continue;
        double across = offset.x() * ray.y() - offset.y() * ray.x();
        if (across * across < shadow) return true;
    }
    return false;
}

/// Leaves of the `found` first of the audience, who are in range, those who are in sight; returns how
/// many.
size_t IdealMedium::leave_visible(const Eigen::Vector2d &from, Neighbours::List around,
                                  size_t found) {
    size_t visible = 0, place = 0;
    for (size_t i = 0; i < found; i++) {
        while (around.begin()[place] != audience_[i].robot) place++;
        if (!hidden(from, place)) audience_[visible++] = audience_[i];
    }
    return visible;
}

}  // namespace kilotwin
