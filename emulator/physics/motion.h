/// Where a robot is while nothing touches it: in closed form from the moment its motion last
/// changed.
#ifndef KILOTWIN_PHYSICS_MOTION_H
#define KILOTWIN_PHYSICS_MOTION_H

#include <Eigen/Core>
#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

struct Pose {
    Eigen::Vector2d position{0, 0};  ///< m, the arena's centre is the origin
    double heading = 0;              ///< rad, counter-clockwise from +x, [-pi, pi)
};

/// A steady motion, in the robot's own frame.
struct Drive {
    Eigen::Vector2d velocity{0, 0};  ///< m/s of the centre: forward, to the left
    double turn = 0;                 ///< rad/s, counter-clockwise
    bool stands() const { return velocity.x() == 0 && velocity.y() == 0; }
    bool at_rest() const { return stands() && turn == 0; }
    bool operator==(const Drive &other) const {
        return velocity == other.velocity && turn == other.turn;
    }
};

class Trajectory {
  public:
    Trajectory() = default;
    Trajectory(Cycles at, const Pose &pose) { restart(at, pose); }

    /// From `at` on the robot is at `pose` and goes on as it was driven.
    void restart(Cycles at, const Pose &pose);

    /// From `at` on it is driven otherwise.
    void change(Cycles at, const Drive &drive);

    /// The pose at `at`, not before the last restart or change.
    Pose pose(Cycles at) const;
    Eigen::Vector2d position(Cycles at) const;
    double heading(Cycles at) const;
    Eigen::Vector2d ahead(Cycles at) const;  ///< unit vector of its heading

    const Drive &drive() const { return drive_; }

  private:
    /// How long it has gone on as it is, s.
    double driven_for(Cycles at) const { return (as_double(at) - since_) * CYCLE_S; }
    Eigen::Vector2d position_after(double time) const;
    double heading_after(double time) const;

    Drive drive_;
    Eigen::Vector2d origin_{0, 0}, ahead_{1, 0};
    double heading_ = 0;
    double since_ = 0;  ///< cycles
};

}  // namespace kilotwin

#endif
