#include "physics/contact/contacts.h"

#include "physics/contact/disc_solver.h"

namespace kilotwin {

namespace {

std::unique_ptr<IslandSolver> solver_for(const Arena &arena, const Mechanics &mechanics,
                                         size_t robots, const std::vector<Object> &objects,
                                         Box2DSolver::Accuracy accuracy) {
    if (objects.empty() && accuracy == Box2DSolver::Accuracy::NORMAL)
        return std::make_unique<DiscSolver>(arena, mechanics);
    return std::make_unique<Box2DSolver>(arena, mechanics, robots, objects, accuracy);
}

}  // namespace

Contacts::Contacts(const Arena &arena, const Profile &profile, double drive_m_s, double fastest_m_s,
                   size_t robots, const std::vector<Object> &objects,
                   Box2DSolver::Accuracy accuracy)
    : driven_(robots),
      held_(robots, false),
      gives_way_(profile.gives_way),
      closed_form_{{profile.radius_m, profile.mass_kg, profile.push_m_s2, drive_m_s, fastest_m_s}},
      grouping_(arena, profile.radius_m),
      solver_(solver_for(arena, closed_form_.mechanics, robots, objects, accuracy)) {}

// It goes on as its trajectory did: turned from the robot's frame into the world's.
void Contacts::add(uint32_t robot, const Trajectory &trajectory, Cycles at) {
    const Eigen::Vector2d ahead = trajectory.ahead(at), v = trajectory.drive().velocity;
    auto &driven = driven_[robot];
    driven.velocity = {turned(v, ahead), trajectory.drive().turn};
    driven.wanted = driven.velocity;
    held_[robot] = true;
}

void Contacts::forget(uint32_t robot) {
    if (!held_[robot]) return;
    remove(robot);
    solver_->forget(robot);
}

void Contacts::step(std::vector<ContactBody> &bodies, const std::vector<ContactPair> &pairs,
                    const std::vector<Islands::PushedObject> &objects, double step_s) {
    force_ = closed_form_.mechanics.change_in(step_s);
    grouping_.choose(bodies, pairs);
    step_in_closed_form(bodies, pairs, step_s);
    if (!before_.empty() && grouping_.find_missed(bodies, pairs)) {
        size_t next = 0;
        for (size_t i = 0; i < bodies.size(); i++) {
            if (!bodies[i].uncertain) continue;
            if (bodies[i].kind == ContactBody::Kind::ISLAND)
                driven_[bodies[i].robot] = before_[next];
            next++;
        }
    }
    islands_.objects.clear();
    for (const auto &pushed : objects) islands_.objects.push_back(pushed);
    step_islands(bodies, pairs, step_s);
}

void Contacts::step_in_closed_form(std::vector<ContactBody> &bodies,
                                   const std::vector<ContactPair> &pairs, double step_s) {
    using Kind = ContactBody::Kind;
    before_.clear();
    for (size_t i = 0; i < bodies.size(); i++) {
        if (bodies[i].uncertain) before_.push_back(driven_[bodies[i].robot]);
        const auto kind = bodies[i].kind;
        if (kind == Kind::NONE || kind == Kind::WALL) step_alone(bodies[i], step_s);
    }
    for (const auto &[one, other, distance_m] : pairs)
        if (bodies[one].kind == Kind::ROBOT && bodies[one].other == other)
            step_pair(bodies[one], bodies[other], step_s);
}

void Contacts::step_islands(std::vector<ContactBody> &bodies, const std::vector<ContactPair> &pairs,
                            double step_s) {
    using Kind = ContactBody::Kind;
    islands_.bodies.clear();
    islands_.pairs.clear();
    for (size_t i = 0; i < bodies.size(); i++)
        if (bodies[i].kind == Kind::ISLAND) add_to_islands(bodies[i]);
    for (const auto &[one, other, distance_m] : pairs)
        if (bodies[one].kind == Kind::ISLAND)
            islands_.pairs.push_back({bodies[one].member, bodies[other].member});
    solver_->solve(islands_, step_s);
    island_steps_ += islands_.bodies.size();
}

/// The body takes part in an island; which one, the solver finds from the pairs.
void Contacts::add_to_islands(ContactBody &body) {
    body.member = static_cast<uint32_t>(islands_.bodies.size());
    body.moved = {};
    auto &driven = driven_[body.robot];
    if (fixed(body)) driven = {};
    islands_.bodies.push_back(
        {body.robot, fixed(body), body.at_wall, body.pose, body.free, driven, body.moved});
}

/// Whether it stands, and cannot be pushed.
bool Contacts::fixed(const ContactBody &body) const {
    return !gives_way_ && body.free.by.isZero(0) && body.free.turn == 0;
}

/// Sets the velocity of a body that is in no island.
ContactSide Contacts::drive(ContactBody &body, double step_s) {
    DrivenBody &driven = driven_[body.robot];
    body.moved = {};
    if (fixed(body))
        driven = {};
    else
        driven.drive(body.free.velocity(step_s), force_);
    return {driven, body.moved};
}

/// Moves a body that touches nothing, or a wall only.
void Contacts::step_alone(ContactBody &body, double step_s) {
    const ContactSide robot = drive(body, step_s);
    if (body.kind == ContactBody::Kind::WALL)
        closed_form_.step(robot, nullptr, body.normal, body.gap_m, step_s);
    else
        robot.moved.add(robot.body.velocity, step_s);
}

/// Moves two bodies that touch each other only.
void Contacts::step_pair(ContactBody &one, ContactBody &other, double step_s) {
    const ContactSide robot = drive(one, step_s), partner = drive(other, step_s);
    if (fixed(other))
        closed_form_.step(robot, nullptr, one.normal, one.gap_m, step_s);
    else if (fixed(one))
        closed_form_.step(partner, nullptr, other.normal, one.gap_m, step_s);
    else
        closed_form_.step(robot, &partner, one.normal, one.gap_m, step_s);
}

}  // namespace kilotwin
