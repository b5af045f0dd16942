#include "engine/motion.h"

#include "engine/trigonometry.h"

namespace kilotwin {

namespace {

/// A vector; or two side by side, if Number is Eigen::Array2d.
template <typename Number> struct Components { Number x, y; };

/// Where one gets from `origin`, heading `ahead`, that is on an arc for `time`.
template <typename Number>
Components<Number> moved(const Components<Number> &origin, const Components<Number> &ahead,
                         const Components<Number> &velocity, const Number &time,
                         const Arc<Number> &arc) {
    const Number forward = velocity.x * time, left = velocity.y * time;
    const Number x = forward * arc.straight - left * arc.aside;
    const Number y = forward * arc.aside + left * arc.straight;
    return {origin.x + (ahead.x * x - ahead.y * y), origin.y + (ahead.y * x + ahead.x * y)};
}

Components<double> components(const Eigen::Vector2d &v) { return {v.x(), v.y()}; }

}  // namespace

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
    const Arc<double> way = drive_.turn == 0 ? Arc<double>{1, 0} : arc(drive_.turn * time);
    const auto [x, y] =
        moved(components(origin_), components(ahead_), components(drive_.velocity), time, way);
    return {x, y};
}

void Trajectory::place(std::span<const Trajectory> trajectories, Cycles at,
                       std::span<Eigen::Vector2d> places) {
    size_t i = 0;
    for (; i + 1 < trajectories.size(); i += 2) place_two(&trajectories[i], at, &places[i]);
    if (i < trajectories.size()) places[i] = trajectories[i].position(at);
}

void Trajectory::place_two(const Trajectory *two, Cycles at, Eigen::Vector2d *places) {
    using Two = Eigen::Array2d;
    const Trajectory &a = two[0], &b = two[1];
    const Two time(seconds(at - a.since_), seconds(at - b.since_));
    const Two angle = Two(a.drive_.turn, b.drive_.turn) * time;
    if ((angle.abs() > SHORT_ARC).any()) {
        places[0] = a.position(at);
        places[1] = b.position(at);
        return;
    }
    auto both = [](const Eigen::Vector2d &one, const Eigen::Vector2d &other) {
        return Components<Two>{Two(one.x(), other.x()), Two(one.y(), other.y())};
    };
    const bool straight = a.drive_.turn == 0 && b.drive_.turn == 0;
    const Arc<Two> way = straight ? Arc<Two>{Two(1, 1), Two(0, 0)} : short_arc(angle);
    const auto [x, y] = moved(both(a.origin_, b.origin_), both(a.ahead_, b.ahead_),
                              both(a.drive_.velocity, b.drive_.velocity), time, way);
    places[0] = {x[0], y[0]};
    places[1] = {x[1], y[1]};
}

Eigen::Vector2d Trajectory::ahead(Cycles at) const {
    return drive_.turn == 0 ? ahead_ : direction(heading(at));
}

double Trajectory::heading(Cycles at) const {
    return drive_.turn == 0 ? heading_ : wrapped(heading_ + drive_.turn * seconds(at - since_));
}

Pose Trajectory::pose(Cycles at) const { return {position(at), heading(at)}; }

}  // namespace kilotwin
