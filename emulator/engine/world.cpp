#include "engine/world.h"

#include <algorithm>

#include "engine/box2d_solver.h"
#include "engine/disc_solver.h"
#include "engine/selection.h"

namespace kilotwin {

namespace {

std::unique_ptr<ContactSolver> make_solver(SolverKind kind, const Arena &arena,
                                           const Mechanics &mechanics, size_t robots) {
    if (kind == SolverKind::BOX2D) return std::make_unique<Box2DSolver>(arena, mechanics, robots);
    return std::make_unique<DiscSolver>(arena, mechanics);
}

}  // namespace

World::World(const Arena &arena, const Profile &profile, SolverKind solver, double drive_m_s,
             double fastest_m_s, size_t robots)
    : driven_(robots),
      held_(robots, false),
      gives_way_(profile.gives_way),
      encounter_{{profile.radius_m, profile.push_m_s2, drive_m_s, fastest_m_s}},
      solver_(make_solver(solver, arena, encounter_.mechanics, robots)) {}

void World::add(uint32_t robot, const Trajectory &trajectory, Cycles at) {
    const Eigen::Vector2d ahead = trajectory.ahead(at), v = trajectory.drive().velocity;
    auto &driven = driven_[robot];
    driven.velocity = {
        {ahead.x() * v.x() - ahead.y() * v.y(), ahead.y() * v.x() + ahead.x() * v.y()},
        trajectory.drive().turn};
    driven.wanted = driven.velocity;
    held_[robot] = true;
    added_++;
    robots_.push_back(robot);
}

void World::remove(uint32_t robot) {
    held_[robot] = false;
    removed_ = true;
}

void World::settle() {
    auto gone = [this](uint32_t robot) { return !held_[robot]; };
    sort_from(robots_, robots_.size() - added_);
    if (removed_)
        robots_.erase(std::remove_if(robots_.begin(), robots_.end(), gone), robots_.end());
    added_ = 0;
    removed_ = false;
}

void World::step(std::vector<Near> &near, const std::vector<Crowd::Pair> &pairs, double step_s) {
    using Company = Near::Company;
    force_ = encounter_.mechanics.change_in(step_s);
    crowd_.members.clear();
    crowd_.pairs.clear();
    for (size_t i = 0; i < near.size(); i++) {
        if (near[i].company == Company::SEVERAL)
            join_crowd(i, near[i]);
        else
            meet(near, i, step_s);
    }
    for (const auto &[one, other] : pairs)
        if (near[one].company == Company::SEVERAL)
            crowd_.pairs.push_back({near[one].member, near[other].member});
    solver_->solve(crowd_, step_s);
}

void World::join_crowd(size_t i, Near &near) {
    near.member = static_cast<uint32_t>(crowd_.members.size());
    near.moved = {};
    auto &driven = driven_[robots_[i]];
    if (firm(near)) driven = {};
    crowd_.members.push_back(
        {robots_[i], firm(near), near.at_wall, near.pose, near.free, driven, near.moved});
}

/// It stands, and does not give way.
bool World::firm(const Near &near) const {
    return !gives_way_ && near.free.by.isZero(0) && near.free.turn == 0;
}

void World::drive(uint32_t robot, Near &near, double step_s) {
    near.moved = {};
    if (firm(near))
        driven_[robot] = {};
    else
        driven_[robot].drive(near.free.velocity(step_s), force_);
}

/// The i-th, who is not in a crowd, and whom it meets: of two, the first sees to both.
void World::meet(std::vector<Near> &near, size_t i, double step_s) {
    using Company = Near::Company;
    Near &one = near[i];
    if (one.company == Company::ROBOT && i > one.other) return;
    drive(robots_[i], one, step_s);
    const Party robot = {driven_[robots_[i]], one.moved};
    if (one.company == Company::NOTHING) {
        robot.move(step_s);
    } else if (one.company == Company::WALL) {
        encounter_.meet(robot, nullptr, one.towards, one.gap_m, step_s);
    } else {
        Near &other = near[one.other];
        drive(robots_[one.other], other, step_s);
        const Party mate = {driven_[robots_[one.other]], other.moved};
        if (firm(other))
            encounter_.meet(robot, nullptr, one.towards, one.gap_m, step_s);
        else if (firm(one))
            encounter_.meet(mate, nullptr, other.towards, one.gap_m, step_s);
        else
            encounter_.meet(robot, &mate, one.towards, one.gap_m, step_s);
    }
}

}  // namespace kilotwin
