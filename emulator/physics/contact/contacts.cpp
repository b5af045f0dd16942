#include "physics/contact/contacts.h"

#include "base/trigonometry.h"
#include "physics/contact/disc_solver.h"

namespace kilotwin {

namespace {

std::unique_ptr<IslandSolver> solver_for(const Arena &arena, const Mechanics &mechanics, Team &team,
                                         size_t robots, const std::vector<Object> &objects,
                                         Box2DSolver::Accuracy accuracy) {
    if (objects.empty() && accuracy == Box2DSolver::Accuracy::NORMAL)
        return std::make_unique<DiscSolver>(arena, mechanics, team);
    return std::make_unique<Box2DSolver>(arena, mechanics, robots, objects, accuracy);
}

}  // namespace

Contacts::Contacts(const Arena &arena, const Profile &profile, Team &team, double drive_m_s,
                   double fastest_m_s, size_t robots, const std::vector<Object> &objects,
                   Box2DSolver::Accuracy accuracy)
    : team_(team),
      gives_way_(profile.gives_way),
      closed_form_{{profile.radius_m, profile.mass_kg, profile.push_m_s2, drive_m_s, fastest_m_s}},
      grouping_(arena, profile.radius_m, team),
      before_(team.size()),
      solver_(solver_for(arena, closed_form_.mechanics, team, robots, objects, accuracy)),
      islands_(team.size()) {}

// It goes on: turned from the robot's frame into the world's.
DrivenBody Contacts::driven_as(double heading, const Drive &drive) {
    const Shift velocity{turned(drive.velocity, direction(heading)), drive.turn};
    return {velocity, velocity};
}

void Contacts::step(Crowd &crowd, const std::vector<Islands::PushedObject> &objects,
                    double step_s) {
    force_ = closed_form_.mechanics.change_in(step_s);
    grouping_.find_groups(crowd);
    team_.share([&](uint32_t share) {
        grouping_.choose(crowd, share);
        step_in_closed_form(crowd, share, step_s);
        take_back_missed(crowd, share);
        if (solver_->solves_by_shares()) list_islands(crowd, share);
    });
    if (!solver_->solves_by_shares()) list_all_islands(crowd);
    islands_[0].objects.clear();
    for (const auto &pushed : objects) islands_[0].objects.push_back(pushed);
    solver_->solve(islands_, step_s);
    for (const Islands &islands : islands_) island_steps_ += islands.bodies.size();
}

void Contacts::step_in_closed_form(Crowd &crowd, uint32_t share, double step_s) {
    using Kind = ContactBody::Kind;
    auto &bodies = crowd.bodies;
    auto &before = before_[share].driven;
    before.clear();
    grouping_.for_each_body(crowd, share, [&](uint32_t i) {
        const ContactBody &body = bodies[i];
        if (body.uncertain) before.push_back(crowd.driven[i]);
        if (body.kind == Kind::NONE || body.kind == Kind::WALL) step_alone(crowd, i, step_s);
    });
    grouping_.for_each_pair(crowd, share, [&](const ContactPair &pair) {
        const auto [one, other, distance_m] = pair;
        if (bodies[one].kind == Kind::ROBOT && bodies[one].other == other)
            step_pair(crowd, one, other, step_s);
    });
}

/// Bodies that are in islands after all are driven again as they were before they moved.
void Contacts::take_back_missed(Crowd &crowd, uint32_t share) {
    const auto &before = before_[share].driven;
    if (before.empty() || !grouping_.find_missed(crowd, share)) return;
    auto next = before.begin();
    grouping_.for_each_body(crowd, share, [&](uint32_t i) {
        const ContactBody &body = crowd.bodies[i];
        if (!body.uncertain) return;
        if (body.kind == ContactBody::Kind::ISLAND) crowd.driven[i] = *next;
        ++next;
    });
}

/// Lists the islands of a share's groups.
void Contacts::list_islands(Crowd &crowd, uint32_t share) {
    Islands &islands = islands_[share];
    islands.bodies.clear();
    islands.pairs.clear();
    grouping_.for_each_body(crowd, share, [&](uint32_t i) { add_to_islands(islands, crowd, i); });
    grouping_.for_each_pair(crowd, share,
                            [&](const ContactPair &pair) { add_to_islands(islands, crowd, pair); });
}

/// Lists all islands as one share's.
void Contacts::list_all_islands(Crowd &crowd) {
    Islands &islands = islands_[0];
    islands.bodies.clear();
    islands.pairs.clear();
    for (uint32_t i = 0; i < crowd.bodies.size(); i++) add_to_islands(islands, crowd, i);
    for (const Crowd::Share &share : crowd.shares)
        for (const ContactPair &pair : share.pairs) add_to_islands(islands, crowd, pair);
}

/// A body that takes part in an island; which one, the solver finds from the pairs.
void Contacts::add_to_islands(Islands &islands, Crowd &crowd, uint32_t i) const {
    ContactBody &body = crowd.bodies[i];
    if (body.kind != ContactBody::Kind::ISLAND) return;
    body.member = static_cast<uint32_t>(islands.bodies.size());
    body.moved = {};
    if (fixed(body)) crowd.driven[i] = {};
    islands.bodies.push_back(
        {body.robot, fixed(body), body.at_wall, body.pose, body.free, crowd.driven[i], body.moved});
}

void Contacts::add_to_islands(Islands &islands, const Crowd &crowd, const ContactPair &pair) {
    const auto &bodies = crowd.bodies;
    if (bodies[pair.one].kind == ContactBody::Kind::ISLAND)
        islands.pairs.push_back({bodies[pair.one].member, bodies[pair.other].member});
}

/// Whether it stands, and cannot be pushed.
bool Contacts::fixed(const ContactBody &body) const {
    return !gives_way_ && body.free.by.isZero(0) && body.free.turn == 0;
}

/// Sets the velocity of a body that is in no island.
ContactSide Contacts::drive(Crowd &crowd, uint32_t i, double step_s) const {
    ContactBody &body = crowd.bodies[i];
    DrivenBody &driven = crowd.driven[i];
    body.moved = {};
    if (fixed(body))
        driven = {};
    else
        driven.drive(body.free.velocity(step_s), force_);
    return {driven, body.moved};
}

/// Moves a body that touches nothing, or a wall only.
void Contacts::step_alone(Crowd &crowd, uint32_t i, double step_s) const {
    const ContactBody &body = crowd.bodies[i];
    const ContactSide robot = drive(crowd, i, step_s);
    if (body.kind == ContactBody::Kind::WALL)
        closed_form_.step(robot, nullptr, body.normal, body.gap_m, step_s);
    else
        robot.moved.add(robot.body.velocity, step_s);
}

/// Moves two bodies that touch each other only.
void Contacts::step_pair(Crowd &crowd, uint32_t i, uint32_t k, double step_s) const {
    const ContactBody &one = crowd.bodies[i], &other = crowd.bodies[k];
    const ContactSide robot = drive(crowd, i, step_s), partner = drive(crowd, k, step_s);
    if (fixed(other))
        closed_form_.step(robot, nullptr, one.normal, one.gap_m, step_s);
    else if (fixed(one))
        closed_form_.step(partner, nullptr, other.normal, one.gap_m, step_s);
    else
        closed_form_.step(robot, &partner, one.normal, one.gap_m, step_s);
}

}  // namespace kilotwin
