/// The arena: walls and sites. Lengths in metres; the arena's centre is the origin. Constant during
/// a run.
#ifndef KILOTWIN_PHYSICS_ARENA_H
#define KILOTWIN_PHYSICS_ARENA_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace kilotwin {

/// A disc or an upright rectangle: the shape of arenas and sites.
struct Region {
    /// The only two for now; sides of a rectangle are parallel to the axes.
    enum class Shape { CIRCLE, RECTANGLE };
    Shape shape;
    Eigen::Vector2d centre;  ///< (0, 0) for an arena
    Eigen::Vector2d size;    ///< width and height; a circle's are both its diameter

    /// Whether `point` lies inside or on the edge.
    bool contains(const Eigen::Vector2d &point) const;

    /// Distance from `point` to the edge, from either side; a lower bound off a rectangle's
    /// corners.
    double distance_to_edge(const Eigen::Vector2d &point) const;
};

/// Shape, sites and walls of a run. Read by bodies (walls), the virtual floor and the recorder
/// (sites).
struct Arena {
    Region bounds;              ///< what the walls enclose
    std::vector<Region> sites;  ///< at most 255, none overlapping

    /// Number of the site at a point: 1 and up in the order of `sites`, 0 for none. Linear in
    /// sites.
    uint8_t site_at(const Eigen::Vector2d &point) const;

    /// Smallest distance_to_edge() of all sites; infinite without sites.
    double distance_to_site_edge(const Eigen::Vector2d &point) const;

    /// Calls `visit(gap, outward)` for each wall: one if round, else four, in a fixed order. `gap`
    /// is the distance of `point` from it, negative beyond it; `outward` the unit vector towards
    /// the wall's nearest point.
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

    /// Distance to the nearest wall; negative beyond it.
    double wall_gap(const Eigen::Vector2d &point) const;
};

}  // namespace kilotwin

#endif
