#include "simulation/floor_sensing.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

FloorSensing::FloorSensing(const std::optional<VirtualFloor::Settings> &settings, Cycles begin,
                           Cycles step, const Arena &arena, double radius_m, const Bodies &bodies)
    : step_(step),
      arena_(arena),
      radius_m_(radius_m),
      bodies_(bodies),
      surroundings_(settings ? bodies.size() : 0) {
    if (settings) floor_.emplace(*settings, begin, step, bodies.size());
}

void FloorSensing::begin_step(Cycles now) {
    now_ = now;
    if (!floor_) return;
    later_sensing_ = floor_->next_sensing(now);
    next_sensing_ = floor_->senses_at(now) ? now : later_sensing_;
}

void FloorSensing::end_step(Cycles now) {
    if (!floor_) return;
    for (uint32_t robot : bodies_.pushed()) look_again_around(robot, begin_of_step(now, step_));
}

// A robot's sensing depends on itself and on those in its list.
void FloorSensing::look_again_around(uint32_t robot, Cycles at) {
    auto look_again = [&](uint32_t other) {
        Cycles &again = surroundings_[other].look_again;
        again = std::min(again, at);
    };
    look_again(robot);
    for (uint32_t other : bodies_.lists().of(robot)) look_again(other);
}

// Squares suffice, but for those so near that the gap decides.
FloorSensing::Nearest FloorSensing::nearest_to(uint32_t robot) const {
    const Eigen::Vector2d here = bodies_.position(robot);
    const bool rests = bodies_.rests(robot);
    const double obstacle_gap = floor_->obstacle_m(), near = near_m();
    Nearest nearest;
    for (uint32_t other : bodies_.lists().of(robot)) {
        const Eigen::Vector2d offset = bodies_.position(other) - here;
        const double square = offset.squaredNorm();
        if (square <= near * near && offset.norm() - 2 * radius_m_ <= obstacle_gap &&
            offset.dot(bodies_.ahead(robot)) > 0)
            nearest.obstacle = true;
        nearest.robot = std::min(nearest.robot, square);
        if (rests && square < nearest.mover && !bodies_.rests(other)) nearest.mover = square;
    }
    return nearest;
}

void FloorSensing::look_around(uint32_t robot) {
    Surroundings &around = surroundings_[robot];
    const Eigen::Vector2d here = bodies_.position(robot);
    const double obstacle_gap = floor_->obstacle_m();
    Nearest nearest = nearest_to(robot);
    // As long as no robot that is on no list can have come near. `unmoved_s`: and none begins to
    // move that rests now.
    const double listed_s =
        bodies_.lists_hold_until() > now_ ? seconds(bodies_.lists_hold_until() - now_) : 0;
    auto away_s = [&](double square) {
        const double way_m = std::max(std::sqrt(square) - near_m(), 0.0);
        return std::min(way_m / (2 * bodies_.fastest_m_s()), listed_s);
    };
    const double unchanged_s = away_s(nearest.robot), unmoved_s = away_s(nearest.mover);
    const double wall_gap = arena_.wall_gap(here) - radius_m_;
    if (wall_gap <= obstacle_gap)
        arena_.for_each_wall(
            here, radius_m_ + obstacle_gap,
            [&](double distance, const Eigen::Vector2d &outward, uint32_t /*wall*/) {
                const double gap = distance - radius_m_;
                if (gap <= obstacle_gap && outward.dot(bodies_.ahead(robot)) > 0)
                    nearest.obstacle = true;
            });
    // As long as its own way to a wall or to a site's edge takes at least.
    const double still_s =
        std::min(std::max(wall_gap - obstacle_gap, 0.0), arena_.distance_to_site_edge(here)) /
        bodies_.fastest_m_s();
    around.cell.site = arena_.site_at(here);
    around.cell.flags = nearest.obstacle ? WIRE_CELL_OBSTACLE : 0;
    around.unchanged_until = now_ + whole_steps(std::min(unchanged_s, still_s), step_);
    // A robot that rests need not look while only resting ones are near: disturb() tells when one
    // begins to move.
    around.look_again = bodies_.rests(robot) ? now_ + std::max(whole_steps(unmoved_s, step_), step_)
                                             : around.unchanged_until;
}

}  // namespace kilotwin
