#include "physics/motion.h"

#include "base/trigonometry.h"

namespace kilotwin {

void Trajectory::restart(Cycles at, const Pose &pose) {
    since_ = as_double(at);
    origin_ = pose.position;
    heading_ = pose.heading;
    ahead_ = direction(pose.heading);
}

void Trajectory::change(Cycles at, const Drive &drive) {
    restart(at, pose(at));
    drive_ = drive;
}

// Straight on, or along a circle: the velocity turns with the robot, and its integral is exact.
Eigen::Vector2d Trajectory::position_after(double time) const {
    if (drive_.stands()) return origin_;
    const Arc way = drive_.turn == 0 ? Arc{1, 0} : arc(drive_.turn * time);
    const double forward = drive_.velocity.x() * time, left = drive_.velocity.y() * time;
    const double x = forward * way.straight - left * way.aside;
    const double y = forward * way.aside + left * way.straight;
    return {origin_.x() + (ahead_.x() * x - ahead_.y() * y),
            origin_.y() + (ahead_.y() * x + ahead_.x() * y)};
}

double Trajectory::heading_after(double time) const {
    return drive_.turn == 0 ? heading_ : wrapped(heading_ + drive_.turn * time);
}

Eigen::Vector2d Trajectory::position(Cycles at) const { return position_after(driven_for(at)); }

double Trajectory::heading(Cycles at) const { return heading_after(driven_for(at)); }

Eigen::Vector2d Trajectory::ahead(Cycles at) const {
    return drive_.turn == 0 ? ahead_ : direction(heading(at));
}

Pose Trajectory::pose(Cycles at) const {
    const double time = driven_for(at);
    return {position_after(time), heading_after(time)};
}

}  // namespace kilotwin
