#include "physics/arena.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilotwin {

bool Region::contains(const Eigen::Vector2d &point) const {
    Eigen::Vector2d offset = point - centre;
    if (shape == Shape::CIRCLE) return offset.squaredNorm() <= size.x() * size.x() / 4;
    return std::abs(offset.x()) <= size.x() / 2 && std::abs(offset.y()) <= size.y() / 2;
}

double Region::distance_to_edge(const Eigen::Vector2d &point) const {
    Eigen::Vector2d offset = point - centre;
    if (shape == Shape::CIRCLE) return std::abs(offset.norm() - size.x() / 2);
    // The largest norm of the offset from the edge's box: exact inside and beside it, too small off
    // its corners.
    return std::abs(
        std::max(std::abs(offset.x()) - size.x() / 2, std::abs(offset.y()) - size.y() / 2));
}

uint8_t Arena::site_at(const Eigen::Vector2d &point) const {
    for (size_t i = 0; i < sites.size(); i++)
        if (sites[i].contains(point)) return static_cast<uint8_t>(i + 1);
    return 0;
}

double Arena::distance_to_site_edge(const Eigen::Vector2d &point) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto &site : sites) nearest = std::min(nearest, site.distance_to_edge(point));
    return nearest;
}

double Arena::wall_gap(const Eigen::Vector2d &point) const {
    if (bounds.shape == Region::Shape::CIRCLE) return bounds.size.x() / 2 - point.norm();
    return (bounds.size / 2 - point.cwiseAbs()).minCoeff();
}

}  // namespace kilotwin
