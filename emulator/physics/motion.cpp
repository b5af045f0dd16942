#include "physics/motion.h"

#include "base/trigonometry.h"

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

/// arc() of two angles; who stands gets nowhere on it.
Arc<Eigen::Array2d> arcs(const Eigen::Array2d &angles, bool first_stands, bool second_stands) {
    const Arc<double> still = {1, 0}, one = first_stands ? still : arc(angles[0]),
                      other = second_stands ? still : arc(angles[1]);
    return {{one.straight, other.straight}, {one.aside, other.aside}};
}

Components<double> components(const Eigen::Vector2d &v) { return {v.x(), v.y()}; }

}  // namespace

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
    const Arc<double> way = drive_.turn == 0 ? Arc<double>{1, 0} : arc(drive_.turn * time);
    const auto [x, y] =
        moved(components(origin_), components(ahead_), components(drive_.velocity), time, way);
    return {x, y};
}

double Trajectory::heading_after(double time) const {
    return drive_.turn == 0 ? heading_ : wrapped(heading_ + drive_.turn * time);
}

void Trajectory::place(std::span<const Trajectory> trajectories, Cycles at,
                       std::span<Eigen::Vector2d> places) {
    using Two = Eigen::Array2d;
    auto both = [](const Eigen::Vector2d &one, const Eigen::Vector2d &other) {
        return Components<Two>{Two(one.x(), other.x()), Two(one.y(), other.y())};
    };
    size_t i = 0;
    for (; i + 1 < trajectories.size(); i += 2) {
        const Trajectory &a = trajectories[i], &b = trajectories[i + 1];
        const Two time = (as_double(at) - Two(a.since_, b.since_)) * CYCLE_S;
        const Two angle = Two(a.drive_.turn, b.drive_.turn) * time;
        const bool straight = a.drive_.turn == 0 && b.drive_.turn == 0;
        Arc<Two> way = straight ? Arc<Two>{Two(1, 1), Two(0, 0)} : short_arcs(angle);
        if (angle.abs().maxCoeff() > SHORT_ARC) [[unlikely]]
            way = arcs(angle, a.drive_.stands(), b.drive_.stands());
        const auto [x, y] = moved(both(a.origin_, b.origin_), both(a.ahead_, b.ahead_),
                                  both(a.drive_.velocity, b.drive_.velocity), time, way);
        places[i] = {x[0], y[0]};
        places[i + 1] = {x[1], y[1]};
    }
    if (i < trajectories.size()) places[i] = trajectories[i].position(at);
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
