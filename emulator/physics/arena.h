/// The arena: walls, obstacles and sites. Lengths in metres; the arena's centre is the origin.
/// Constant during a run.
#ifndef KILOTWIN_PHYSICS_ARENA_H
#define KILOTWIN_PHYSICS_ARENA_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "physics/raster.h"
#include "physics/region.h"
#include "physics/walls.h"

namespace kilotwin {

/// Shape, sites and walls of a run. Read by bodies and channels (walls), the virtual floor and the
/// recorder (sites).
struct Arena {
    Region bounds;              ///< what the walls enclose
    std::vector<Region> sites;  ///< at most 255, none overlapping
    std::vector<Obstacle> obstacles = {};
    /// Walls of bounds and obstacles; empty, if bounds are round or an upright rectangle, and
    /// nothing stands in them: then bounds are the walls.
    Walls walls = {};
    /// Numbers of sites, by pixel, with Raster::find_distances() done. Where one of `sites` is,
    /// that counts.
    Raster floor = {};

    /// Makes `walls` from bounds and obstacles. Those within `reach_m` of a point will be found in
    /// constant time (walls.h).
    void build_walls(bool bounds_block_light, double reach_m);

    /// Number of the site at a point: 1 and up in the order of `sites`, 0 for none. Linear in
    /// sites, but for those of the picture.
    uint8_t site_at(const Eigen::Vector2d &point) const;

    /// A lower bound of the distance to where site_at() is another; infinite without sites.
    double distance_to_site_edge(const Eigen::Vector2d &point) const;

    /// Calls `visit(gap, outward, wall)` for each wall within `reach_m` of `point`, and maybe for
    /// farther ones, by ascending numbers. `gap` is the distance of `point` from it, negative
    /// beyond it; `outward` the unit vector towards the wall's nearest point; `wall` its number: 0
    /// for a round hall, 0 to 3 for an upright rectangle without obstacles, else as in walls.h.
    template <typename Visit>
    void for_each_wall(const Eigen::Vector2d &point, double reach_m, Visit visit) const {
        if (!walls.empty()) {
            walls.for_each(point, reach_m, visit);
            return;
        }
        if (bounds.shape == Region::Shape::CIRCLE) {
            double distance = point.norm();
            Eigen::Vector2d outward = Eigen::Vector2d::UnitX();
            if (distance > 0) outward = point / distance;
            visit(bounds.size.x() / 2 - distance, outward, uint32_t{0});
            return;
        }
        uint32_t wall = 0;
        for (int axis = 0; axis < 2; axis++)
            for (double side : {-1.0, 1.0}) {
                Eigen::Vector2d outward = Eigen::Vector2d::Zero();
                outward[axis] = side;
                visit(bounds.size[axis] / 2 - side * point[axis], outward, wall++);
            }
    }

    /// Distance to the nearest wall; negative beyond it. Of walls.h far from all walls, a lower
    /// bound.
    double wall_gap(const Eigen::Vector2d &point) const {
        if (!walls.empty()) return walls.gap(point);
        if (bounds.shape == Region::Shape::CIRCLE) return bounds.size.x() / 2 - point.norm();
        return (bounds.size / 2 - point.cwiseAbs()).minCoeff();
    }

    /// Whether the straight line between any two points within the walls meets no wall.
    bool is_open() const { return walls.empty(); }

    /// Whether a disc of `radius_m`, at most the reach of build_walls(), touches nothing solid.
    /// Linear in obstacles.
    bool has_room(const Eigen::Vector2d &point, double radius_m) const;

    /// Whether light goes from one point to another: no wall that blocks it is in between.
    bool lets_light_pass(const Eigen::Vector2d &from, const Eigen::Vector2d &to) const {
        return walls.empty() || walls.lets_light_pass(from, to);
    }
};

}  // namespace kilotwin

#endif
