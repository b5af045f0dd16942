#include "physics/arena.h"

#include <algorithm>

namespace kilotwin {

void Arena::build_walls(bool bounds_block_light, double reach_m) {
    if (bounds.shape != Region::Shape::POLYGON && obstacles.empty()) return;
    walls = Walls(bounds, bounds_block_light, obstacles, reach_m);
}

uint8_t Arena::site_at(const Eigen::Vector2d &point) const {
    for (size_t i = 0; i < sites.size(); i++)
        if (sites[i].contains(point)) return static_cast<uint8_t>(i + 1);
    return floor.at(point);
}

double Arena::distance_to_site_edge(const Eigen::Vector2d &point) const {
    double nearest = floor.distance_to_other(point);
    for (const auto &site : sites) nearest = std::min(nearest, site.distance_to_edge(point));
    return nearest;
}

// The nearest wall may be one that another obstacle covers.
bool Arena::has_room(const Eigen::Vector2d &point, double radius_m) const {
    if (wall_gap(point) < radius_m) return false;
    return walls.empty() ||
           (bounds.contains(point) &&
            std::none_of(obstacles.begin(), obstacles.end(),
                         [&](const auto &obstacle) { return obstacle.shape.contains(point); }));
}

}  // namespace kilotwin
