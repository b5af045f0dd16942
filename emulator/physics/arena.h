/// The floor and what is drawn on it. Lengths in metres, the arena's centre is the origin.
#ifndef KILOTWIN_PHYSICS_ARENA_H
#define KILOTWIN_PHYSICS_ARENA_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace kilotwin {

/// A disc or an upright rectangle.
struct Region {
    enum class Shape { CIRCLE, RECTANGLE };
    Shape shape;
    Eigen::Vector2d centre;
    Eigen::Vector2d size;  ///< width and height; a circle's are both its diameter

    bool contains(const Eigen::Vector2d &point) const;

    /// Distance from `point` to the edge, from either side; never more than the true one.
    double distance_to_edge(const Eigen::Vector2d &point) const;
};

struct Arena {
    Region bounds;              ///< what the walls enclose
    std::vector<Region> sites;  ///< at most 255, none overlapping

    /// The site under a point: 1.. in the order of `sites`, 0 for none. An edge belongs to its
    /// site.
    uint8_t site_at(const Eigen::Vector2d &point) const;

    /// Smallest distance from `point` to an edge of any site.
    double distance_to_site_edge(const Eigen::Vector2d &point) const;

    /// Calls `visit(gap, outward)` for each wall: distance of `point` from it (negative beyond it)
    /// and the unit vector towards its nearest point.
    template <typename Visit> void for_each_wall(const Eigen::Vector2d &point, Visit visit) const {
        if (bounds.shape == Region::Shape::CIRCLE) {
            double distance = point.norm();
            Eigen::Vector2d outward = Eigen::Vector2d::UnitX();
            if (distance > 0) outward = point / distance;
            visit(bounds.size.x() / 2 - distance, outward);
            return;
        }
        for (int axis = 0; axis < 2; axis++)
            for (double side : {-1.0, 1.0}) {
                Eigen::Vector2d outward = Eigen::Vector2d::Zero();
                outward[axis] = side;
                visit(bounds.size[axis] / 2 - side * point[axis], outward);
            }
    }

    /// Distance to the nearest wall.
    double wall_gap(const Eigen::Vector2d &point) const;
};

}  // namespace kilotwin

#endif
