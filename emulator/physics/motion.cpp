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

double Trajectory::heading_after(double time) const {
    return drive_.turn == 0 ? heading_ : wrapped(heading_ + drive_.turn * time);
}

double Trajectory::heading(Cycles at) const { return heading_after(driven_for(at)); }

Eigen::Vector2d Trajectory::ahead(Cycles at) const {
    return drive_.turn == 0 ? ahead_ : direction(heading(at));
}

Pose Trajectory::pose(Cycles at) const {
    const double time = driven_for(at);
    return {position_after(time), heading_after(time)};
}

}  // namespace kilotwin
