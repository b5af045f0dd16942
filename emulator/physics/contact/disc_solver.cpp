#include "physics/contact/disc_solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/clock.h"

namespace kilotwin {

namespace {

constexpr uint32_t WALLS = 4;   // at most; the first discs
constexpr int ROUNDS = 2;       // in each tick, through all contacts
constexpr int PARTINGS = 3;     // in each tick, of those that overlap, each as fast as they part
constexpr double SLOP = 0.001;  // of a radius: such an overlap stays
constexpr double TICKS_PER_S = 1 / TICK_S;
constexpr double TOLERANCE = 0.005;  // of the speed of the fastest drive: such a push is left out

// Without a branch, as nobody can foresee which it is.
double larger(double a, double b) { return a < b ? b : a; }
double smaller(double a, double b) { return b < a ? b : a; }

}  // namespace

void DiscSolver::solve(Crowd &crowd, double step_s) {
    find_islands(crowd);
    place_discs(crowd);
    list_contacts(crowd, step_s);
    recall();
    place_contacts();
    for (const Island &island : islands_) solve(island, crowd, step_s);
    keep();
}

void DiscSolver::find_islands(const Crowd &crowd) {
    const auto count = static_cast<uint32_t>(crowd.members.size());
    auto &with = with_;
    with.resize(count);
    std::iota(with.begin(), with.end(), 0);
    auto first_of = [&](uint32_t member) {
        while (with[member] != member) member = with[member] = with[with[member]];
        return member;
    };
    for (const auto &[one, other] : crowd.pairs) {
        const auto [first, second] = std::minmax({first_of(one), first_of(other)});
        with[second] = first;
    }
    islands_.clear();
    island_.resize(count);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t first = first_of(i);
        if (first == i) {
            island_[i] = static_cast<uint32_t>(islands_.size());
            islands_.emplace_back();
        }
        island_[i] = island_[first];
        islands_[island_[i]].discs++;
    }
}

/// Lays the discs of each island side by side.
void DiscSolver::place_discs(const Crowd &crowd) {
    uint32_t disc = WALLS;
    for (Island &island : islands_) {
        island.first_disc = disc;
        disc += std::exchange(island.discs, 0);
    }
    discs_.resize(disc);
    disc_of_.resize(crowd.members.size());
    for (uint32_t i = 0; i < crowd.members.size(); i++) {
        const auto &member = crowd.members[i];
        Island &island = islands_[island_[i]];
        disc_of_[i] = island.first_disc + island.discs++;
        discs_[disc_of_[i]] = {.at = member.pose.position,
                               .velocity = member.driven.velocity.by,
                               .rim = member.driven.velocity.turn * mechanics_.radius_m,
                               .yields = member.firm ? 0.0 : 1.0,
                               .member = i};
    }
}

/// Whom and what the members may touch in this step.
void DiscSolver::list_contacts(const Crowd &crowd, double step_s) {
    listed_.clear();
    names_.clear();
    const double wall_reach_m = mechanics_.radius_m + mechanics_.fastest_m_s * step_s;
    auto pair = crowd.pairs.begin();
    for (uint32_t i = 0; i < crowd.members.size(); i++) {
        const auto &member = crowd.members[i];
        for (; pair != crowd.pairs.end() && pair->one == i; ++pair) {
            const auto &mate = crowd.members[pair->other];
            if (member.firm && mate.firm) continue;
            listed_.push_back({.one = disc_of_[i], .other = disc_of_[pair->other]});
            names_.push_back({member.robot, mate.robot});
        }
        if (!member.at_wall || member.firm) continue;
        uint32_t wall = 0;
        const auto &at = member.pose.position;
        arena_.for_each_wall(at, [&](double distance, const Eigen::Vector2d &outward) {
            if (distance <= wall_reach_m) {
                listed_.push_back({.one = disc_of_[i],
                                   .other = wall,
                                   .wall_m = distance + outward.dot(at),
                                   .towards = outward});
                names_.push_back({member.robot, UINT32_MAX - WALLS + wall});
            }
            wall++;
        });
    }
}

/// A contact begins with what pushed it at the end of the last step.
void DiscSolver::recall() {
    auto kept = kept_.begin();
    for (size_t i = 0; i < listed_.size(); i++) {
        while (kept != kept_.end() && kept->name < names_[i]) ++kept;
        if (kept == kept_.end()) return;
        if (kept->name != names_[i]) continue;
        listed_[i].along = kept->along;
        listed_[i].across = kept->across;
    }
}

void DiscSolver::keep() {
    kept_.clear();
    for (size_t i = 0; i < listed_.size(); i++) {
        const Contact &contact = contacts_[contact_of_[i]];
        if (contact.along > 0) kept_.push_back({names_[i], contact.along, contact.across});
    }
}

/// Lays the contacts of each island side by side.
void DiscSolver::place_contacts() {
    auto island_of = [this](const Contact &contact) -> Island & {
        return islands_[island_[discs_[contact.one].member]];
    };
    for (const Contact &contact : listed_) island_of(contact).contacts++;
    uint32_t first = 0;
    for (Island &island : islands_) {
        island.first_contact = first;
        first += std::exchange(island.contacts, 0);
    }
    contacts_.resize(first);
    contact_of_.resize(first);
    for (size_t i = 0; i < listed_.size(); i++) {
        Island &island = island_of(listed_[i]);
        contact_of_[i] = island.first_contact + island.contacts++;
        contacts_[contact_of_[i]] = listed_[i];
    }
}

void DiscSolver::solve(const Island &island, const Crowd &crowd, double step_s) {
    const auto ticks = std::lround(step_s / TICK_S);
    for (int tick = 0; tick < ticks; tick++) {
        drive(island, crowd, tick, step_s);
        find_touches(island);
        part_tight();
        settle_all();
        move(island);
    }
    for (const Disc &disc : discs_of(island)) {
        const auto &member = crowd.members[disc.member];
        member.driven.velocity = disc.speed(mechanics_.radius_m);
        member.moved = {disc.at - member.pose.position, disc.rim_way / mechanics_.radius_m};
    }
}

void DiscSolver::drive(const Island &island, const Crowd &crowd, int tick, double step_s) {
    for (Disc &disc : discs_of(island)) {
        disc.pushed_at = 1;
        if (disc.yields == 0) continue;
        const auto &member = crowd.members[disc.member];
        Driven &driven = member.driven;
        driven.velocity = disc.speed(mechanics_.radius_m);
        if (tick == 0)
            driven.drive(member.free.velocity(step_s), force_);
        else
            driven.drive_on(force_);
        disc.velocity = driven.velocity.by;
        disc.rim = driven.velocity.turn * mechanics_.radius_m;
    }
}

/// Finds the contacts that may close within this tick; they begin with the impulses of the last.
void DiscSolver::find_touches(const Island &island) {
    touches_.clear();
    tight_.clear();
    pushes_ = 1;
    for (uint32_t i = 0; i < island.contacts; i++) {
        Contact &contact = contacts_[island.first_contact + i];
        const double gap_m = approach(contact);
        if (gap_m == INFINITY) {
            contact.along = contact.across = 0;
            continue;
        }
        contact.free_m_s = larger(gap_m, 0) * TICKS_PER_S;
        contact.seen_at = 0;
        touches_.push_back(island.first_contact + i);
        if (contact.along > 0) push(contact, contact.along, contact.across);
        if (gap_m < -SLOP * mechanics_.radius_m) tight_.push_back(island.first_contact + i);
    }
}

/// The gap of two that may touch in this tick; INFINITY of others.
double DiscSolver::approach(Contact &contact) const {
    const double nearer_m = mechanics_.fastest_m_s * TICK_S;
    if (contact.other < WALLS) {
        const double gap = gap_m(contact);
        return gap <= nearer_m ? gap : INFINITY;
    }
    const double reach_m = 2 * (mechanics_.radius_m + nearer_m);
    const Eigen::Vector2d apart = discs_[contact.other].at - discs_[contact.one].at;
    const double square = apart.squaredNorm();
    if (square > reach_m * reach_m) return INFINITY;
    const double distance = std::sqrt(square);
    if (distance > 0) contact.towards = apart / distance;
    return distance - 2 * mechanics_.radius_m;
}

/// By the line between the two when the tick began.
double DiscSolver::gap_m(const Contact &contact) const {
    const double to_m = contact.towards.dot(discs_[contact.one].at);
    if (contact.other < WALLS) return contact.wall_m - to_m - mechanics_.radius_m;
    return contact.towards.dot(discs_[contact.other].at) - to_m - 2 * mechanics_.radius_m;
}

void DiscSolver::part(const Contact &contact) {
    const double over_m = -gap_m(contact) - SLOP * mechanics_.radius_m;
    if (over_m <= 0) return;
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    const double most_m = mechanics_.part_m_s * TICK_S;
    const double way_m = std::min(over_m, most_m) / (one.yields + other.yields);
    one.at -= one.yields * way_m * contact.towards;
    other.at += other.yields * way_m * contact.towards;
}

/// Those who part come upon others.
void DiscSolver::part_tight() {
    for (int parting = 0; parting < PARTINGS; parting++)
        for (uint32_t i : tight_) part(contacts_[i]);
}

void DiscSolver::settle_all() {
    for (int round = 0; round < ROUNDS; round++) {
        bool pushed = false;
        for (uint32_t i : touches_) pushed |= settle(contacts_[i]);
        if (!pushed) return;
    }
}

/// Gives a contact what it lacks. Says whether it lacked anything.
bool DiscSolver::settle(Contact &contact) {
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    if (std::max(one.pushed_at, other.pushed_at) <= contact.seen_at) return false;
    contact.seen_at = pushes_;
    const double share = 1 - one.yields * other.yields / 2;
    const Eigen::Vector2d closing = one.velocity - other.velocity;
    const Eigen::Vector2d aside(-contact.towards.y(), contact.towards.x());
    const double nearer = closing.dot(contact.towards) - contact.free_m_s;
    const double along = larger(contact.along + share * nearer, 0);
    if (along == 0 && contact.along == 0) return false;
    // At the rim, across the line, a disc resists with a third of its mass.
    const double slip = closing.dot(aside) + one.rim + other.rim;
    const double most = FRICTION * along;
    const double across = larger(smaller(contact.across - share * slip / 3, most), -most);
    const double more = along - contact.along, rub = across - contact.across;
    if (std::abs(more) + std::abs(rub) <= TOLERANCE * mechanics_.part_m_s) return false;
    contact.along = along;
    contact.across = across;
    push(contact, more, rub);
    contact.seen_at = one.pushed_at = ++pushes_;
    if (contact.other >= WALLS) other.pushed_at = pushes_;
    return true;
}

/// A disc's inertia is m r^2 / 2.
void DiscSolver::push(const Contact &contact, double along, double across) {
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    const Eigen::Vector2d aside(-contact.towards.y(), contact.towards.x());
    const Eigen::Vector2d impulse = across * aside - along * contact.towards;
    one.velocity += one.yields * impulse;
    one.rim += one.yields * 2 * across;
    other.velocity -= other.yields * impulse;
    other.rim += other.yields * 2 * across;
}

void DiscSolver::move(const Island &island) {
    for (Disc &disc : discs_of(island)) {
        const double square = disc.velocity.squaredNorm();
        if (square > mechanics_.fastest_m_s * mechanics_.fastest_m_s)
            disc.velocity *= mechanics_.fastest_m_s / std::sqrt(square);
        disc.at += disc.velocity * TICK_S;
        disc.rim_way += disc.rim * TICK_S;
    }
}

}  // namespace kilotwin
