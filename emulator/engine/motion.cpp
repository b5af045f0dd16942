#include "engine/motion.h"

#include "engine/trigonometry.h"

namespace kilotwin {

void Trajectory::restart(Cycles at, const Pose &pose) {
    since_ = at;
    origin_ = pose.position;
    heading_ = pose.heading;
    ahead_ = direction(pose.heading);
}

void Trajectory::change(Cycles at, const Drive &drive) {
    restart(at, pose(at));
    drive_ = drive;
}

// Straight on, or along a circle: the velocity turns with the robot, and its integral is exact.
Eigen::Vector2d Trajectory::position(Cycles at) const {
    if (drive_.stands()) return origin_;
    const double time = seconds(at - since_);
    const Eigen::Vector2d &v = drive_.velocity;
    Eigen::Vector2d shift = v * time;
    if (drive_.turn != 0) {
        const Eigen::Vector2d way = arc(drive_.turn * time);
        shift = {shift.x() * way.x() - shift.y() * way.y(),
                 shift.x() * way.y() + shift.y() * way.x()};
    }
    return origin_ + Eigen::Vector2d(ahead_.x() * shift.x() - ahead_.y() * shift.y(),
                                     ahead_.y() * shift.x() + ahead_.x() * shift.y());
}

Eigen::Vector2d Trajectory::ahead(Cycles at) const {
    return drive_.turn == 0 ? ahead_ : direction(heading(at));
}

double Trajectory::heading(Cycles at) const {
    return drive_.turn == 0 ? heading_ : wrapped(heading_ + drive_.turn * seconds(at - since_));
}

Pose Trajectory::pose(Cycles at) const { return {position(at), heading(at)}; }

}  // namespace kilotwin
