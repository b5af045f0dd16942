#include "engine/motion.h"

#include <algorithm>

#include "engine/trigonometry.h"

namespace kilotwin {

Drive Profile::drive(uint8_t left, uint8_t right) const {
    if (left == 0 && right == 0) return {};
    if (right == 0) return {0, turn_rad_s};
    if (left == 0) return {0, -turn_rad_s};
    double share = std::min({double(left) / straight_left, double(right) / straight_right, 1.0});
    return {speed_m_s * share, 0};
}

void Trajectory::restart(Cycles at, const Pose &pose) {
    since_ = at;
    origin_ = pose;
    ahead_ = direction(pose.heading);
}

void Trajectory::change(Cycles at, const Drive &drive) {
    restart(at, pose(at));
    drive_ = drive;
}

Eigen::Vector2d Trajectory::position(Cycles at) const {
    return origin_.position + ahead_ * (drive_.speed * seconds(at - since_));
}

Eigen::Vector2d Trajectory::ahead(Cycles at) const {
    return drive_.turn == 0 ? ahead_ : direction(pose(at).heading);
}

Pose Trajectory::pose(Cycles at) const {
    if (drive_.turn == 0) return {position(at), origin_.heading};
    return {position(at), wrapped(origin_.heading + drive_.turn * seconds(at - since_))};
}

}  // namespace kilotwin
