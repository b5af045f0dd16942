/// Where a robot is while nothing touches it: in closed form from the moment its motion last changed.
#ifndef KILOTWIN_ENGINE_MOTION_H
#define KILOTWIN_ENGINE_MOTION_H

#include <Eigen/Core>

#include "engine/clock.h"

namespace kilotwin {

struct Pose {
    Eigen::Vector2d position{0, 0};  ///< m, the arena's centre is the origin
    double heading = 0;              ///< rad, counter-clockwise from +x, [-pi, pi)
};

/// What the motors ask for, in the robot's own frame.
struct Drive {
    double speed = 0;  ///< m/s, forward
    double turn = 0;   ///< rad/s, counter-clockwise, on the spot
    bool at_rest() const { return speed == 0 && turn == 0; }
    bool operator==(const Drive &) const = default;
};

/// A kind of robot (design.md 5.1).
struct Profile {
    double radius_m;
    double speed_m_s;     ///< both motors at their straight duties
    double turn_rad_s;    ///< one motor on
    double push_m_s2;     ///< the drive's force over the robot's mass; friction when it is off
    uint8_t straight_left, straight_right, turn_left, turn_right;  ///< calibrated duties

    /// The motion that duties of the motors cause.
    Drive drive(uint8_t left, uint8_t right) const;
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
    Eigen::Vector2d ahead(Cycles at) const;  ///< unit vector of its heading

    const Drive &drive() const { return drive_; }

  private:
    Cycles since_ = 0;
    Pose origin_;
    Eigen::Vector2d ahead_{1, 0};
    Drive drive_;
};

}  // namespace kilotwin

#endif
