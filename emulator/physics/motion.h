/// Motion of a robot that nothing touches, in closed form: since its drive last changed it goes
/// straight on or along a circle. Evaluating it takes no steps, so that a pose is exact at any
/// time. Lengths in metres, angles in radians, counter-clockwise from +x.
#ifndef KILOTWIN_PHYSICS_MOTION_H
#define KILOTWIN_PHYSICS_MOTION_H

#include <Eigen/Core>
#include <cstdint>

#include "base/clock.h"
#include "base/trigonometry.h"

namespace kilotwin {

struct Pose {
    Eigen::Vector2d position{0, 0};  ///< m, the arena's centre is the origin
    double heading = 0;              ///< rad, counter-clockwise from +x, [-pi, pi)
};

/// A steady motion, in the robot's own frame. The chassis makes it from duties.
struct Drive {
    Eigen::Vector2d velocity{0, 0};  ///< m/s of the centre: forward, to the left
    double turn = 0;                 ///< rad/s, counter-clockwise
    /// Whether the centre stays where it is.
    bool stands() const { return velocity.x() == 0 && velocity.y() == 0; }
    /// Whether it does not turn either.
    bool at_rest() const { return stands() && turn == 0; }
    bool operator==(const Drive &other) const {
        return velocity == other.velocity && turn == other.turn;
    }
};

/// A pose and a drive at one moment, and what follows from them. A robot in contact is restarted at
/// each world step; any other only where its drive changes. 80 bytes; bodies keep one for each
/// robot (physics/bodies.h), and a copy of those that change their drive within a step.
class Trajectory {
  public:
    /// At the origin, at rest, from time 0.
    Trajectory() = default;
    Trajectory(Cycles at, const Pose &pose) { restart(at, pose); }

    /// Puts the robot at `pose` at `at`; it keeps its drive.
    void restart(Cycles at, const Pose &pose);

    /// Changes the drive at `at`; the pose goes on from where the old drive brought it.
    void change(Cycles at, const Drive &drive);

    // State at `at`, which is not before the last restart() or change().
    Pose pose(Cycles at) const;
    Eigen::Vector2d position(Cycles at) const;  ///< centre, m
    double heading(Cycles at) const;            ///< rad, [-pi, pi)
    Eigen::Vector2d ahead(Cycles at) const;     ///< unit vector of its heading

    /// The present drive, as change() set it; restart() keeps it. At rest until then.
    const Drive &drive() const { return drive_; }

  private:
    /// Seconds since the last restart() or change().
    double driven_for(Cycles at) const { return (as_double(at) - since_) * CYCLE_S; }
    Eigen::Vector2d position_after(double time) const;
    double heading_after(double time) const;

    Drive drive_;
    Eigen::Vector2d origin_{0, 0}, ahead_{1, 0};  ///< where and whither it set off
    double heading_ = 0;                          ///< then
    double since_ = 0;                            ///< cycles; exact below 2^53
};

// Straight on, or along a circle: the velocity turns with the robot, and its integral is exact.
// Inline since each world step places all robots.
inline Eigen::Vector2d Trajectory::position_after(double time) const {
    if (drive_.stands()) return origin_;
    const Arc way = arc(drive_.turn * time);
    const double forward = drive_.velocity.x() * time, left = drive_.velocity.y() * time;
    const double x = forward * way.straight - left * way.aside;
    const double y = forward * way.aside + left * way.straight;
    return {origin_.x() + (ahead_.x() * x - ahead_.y() * y),
            origin_.y() + (ahead_.y() * x + ahead_.x() * y)};
}

inline Eigen::Vector2d Trajectory::position(Cycles at) const {
    return position_after(driven_for(at));
}

}  // namespace kilotwin

#endif
