#include "physics/world.h"

#include <algorithm>

#include "base/selection.h"
#include "physics/contact/box2d_solver.h"
#include "physics/contact/disc_solver.h"

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
        const auto company = near[i].company;
        if (company == Company::ROBOT) continue;  // below, by pairs
        if (company == Company::SEVERAL)
            join_crowd(i, near[i]);
        else
            meet_wall(i, near[i], step_s);
    }
    for (const auto &[one, other] : pairs) {
        if (near[one].company == Company::ROBOT)
            meet(one, near[one], other, near[other], step_s);
        else
            crowd_.pairs.push_back({near[one].member, near[other].member});
    }
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

/// Sets the velocity of the i-th, who is not in a crowd.
Party World::drive(size_t i, Near &near, double step_s) {
    Driven &driven = driven_[robots_[i]];
    near.moved = {};
    if (firm(near))
        driven = {};
    else
        driven.drive(near.free.velocity(step_s), force_);
    return {driven, near.moved};
}

/// The i-th is alone, or alone at a wall.
void World::meet_wall(size_t i, Near &near, double step_s) {
    const Party robot = drive(i, near, step_s);
    if (near.company == Near::Company::WALL)
        encounter_.meet(robot, nullptr, near.towards, near.gap_m, step_s);
    else
        robot.moved.add(robot.driven.velocity, step_s);
}

/// The i-th and the k-th are alone.
void World::meet(size_t i, Near &one, size_t k, Near &other, double step_s) {
    const Party robot = drive(i, one, step_s), mate = drive(k, other, step_s);
    if (firm(other))
        encounter_.meet(robot, nullptr, one.towards, one.gap_m, step_s);
    else if (firm(one))
        encounter_.meet(mate, nullptr, other.towards, one.gap_m, step_s);
    else
        encounter_.meet(robot, &mate, one.towards, one.gap_m, step_s);
}

}  // namespace kilotwin
