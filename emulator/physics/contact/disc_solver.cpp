#include "physics/contact/disc_solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/clock.h"

namespace kilotwin {

namespace {

constexpr uint32_t WALLS = 1;              // the first disc stands for all walls: they do not move
constexpr uint32_t FIRST_WALL = 1U << 31;  // numbers of walls in a key follow those of robots
constexpr int ROUNDS = 2;                  // of solving velocities, in each tick
constexpr int SEPARATIONS = 3;             // rounds of separating overlapping discs, in each tick
constexpr double SLOP = 0.001;             // share of a radius: a smaller overlap is left
constexpr double TICKS_PER_S = 1 / TICK_S;
constexpr double TOLERANCE =
    0.005;  // share of the fastest drive's speed: smaller impulses are dropped

// Compiled to one instruction; a branch here could not be predicted.
double max_of(double a, double b) { return a < b ? b : a; }
double min_of(double a, double b) { return b < a ? b : a; }

}  // namespace

void DiscSolver::solve(Islands &islands, double step_s) {
    find_islands(islands);
    place_discs(islands);
    list_contacts(islands, step_s);
    warm_start();
    place_contacts();
    for (const Island &island : islands_) solve(island, islands, step_s);
    store_impulses();
}

/// Islands by union-find over the pairs, in the order of their first bodies.
void DiscSolver::find_islands(const Islands &islands) {
    const auto count = static_cast<uint32_t>(islands.bodies.size());
    parent_.resize(count);
    std::iota(parent_.begin(), parent_.end(), 0);
    auto root_of = [this](uint32_t body) {
        while (parent_[body] != body) body = parent_[body] = parent_[parent_[body]];
        return body;
    };
    for (const auto &[one, other] : islands.pairs) {
        const auto [first, second] = std::minmax({root_of(one), root_of(other)});
        parent_[second] = first;
    }
    islands_.clear();
    island_.resize(count);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t first = root_of(i);
        if (first == i) {
            island_[i] = static_cast<uint32_t>(islands_.size());
            islands_.emplace_back();
        }
        island_[i] = island_[first];
        islands_[island_[i]].discs++;
    }
}

/// Lays the discs of each island side by side.
void DiscSolver::place_discs(const Islands &islands) {
    uint32_t disc = WALLS;
    for (Island &island : islands_) {
        island.first_disc = disc;
        disc += std::exchange(island.discs, 0);
    }
    discs_.resize(disc);
    disc_of_.resize(islands.bodies.size());
    for (uint32_t i = 0; i < islands.bodies.size(); i++) {
        const auto &body = islands.bodies[i];
        Island &island = islands_[island_[i]];
        disc_of_[i] = island.first_disc + island.discs++;
        discs_[disc_of_[i]] = {.at = body.pose.position,
                               .velocity = body.driven.velocity.by,
                               .rim = body.driven.velocity.turn * mechanics_.radius_m,
                               .inverse_mass = body.fixed ? 0.0 : 1.0,
                               .body = i};
    }
}

/// Lists the contacts that bodies may have in this step, and their keys.
void DiscSolver::list_contacts(const Islands &islands, double step_s) {
    listed_.clear();
    keys_.clear();
    auto pair = islands.pairs.begin();
    for (uint32_t i = 0; i < islands.bodies.size(); i++) {
        const auto &body = islands.bodies[i];
        for (; pair != islands.pairs.end() && pair->one == i; ++pair) {
            const auto &other = islands.bodies[pair->other];
            if (body.fixed && other.fixed) continue;
            listed_.push_back({.one = disc_of_[i], .other = disc_of_[pair->other]});
            keys_.push_back({body.robot, other.robot});
        }
        if (body.at_wall && !body.fixed) list_walls(body, disc_of_[i], step_s);
    }
}

/// The walls that a body may reach within the step.
void DiscSolver::list_walls(const Islands::Body &body, uint32_t disc, double step_s) {
    const double reach_m = mechanics_.radius_m + mechanics_.fastest_m_s * step_s;
    const auto &at = body.pose.position;
    arena_.for_each_wall(
        at, reach_m, [&](double distance, const Eigen::Vector2d &outward, uint32_t wall) {
            if (distance > reach_m) return;
            listed_.push_back(
                {.one = disc, .other = 0, .wall_m = distance + outward.dot(at), .normal = outward});
            keys_.push_back({body.robot, FIRST_WALL + wall});
        });
}

/// Contacts of the last step start from its impulses.
void DiscSolver::warm_start() {
    auto stored = stored_.begin();
    for (size_t i = 0; i < listed_.size(); i++) {
        while (stored != stored_.end() && stored->key < keys_[i]) ++stored;
        if (stored == stored_.end()) return;
        if (stored->key != keys_[i]) continue;
        listed_[i].normal_impulse = stored->normal;
        listed_[i].tangent_impulse = stored->tangent;
    }
}

/// By the bodies' numbers, since contacts lie elsewhere in the next step.
void DiscSolver::store_impulses() {
    stored_.clear();
    for (size_t i = 0; i < listed_.size(); i++) {
        const Contact &contact = contacts_[contact_of_[i]];
        if (contact.normal_impulse > 0)
            stored_.push_back({keys_[i], contact.normal_impulse, contact.tangent_impulse});
    }
}

/// Lays the contacts of each island side by side.
void DiscSolver::place_contacts() {
    auto island_of = [this](const Contact &contact) -> Island & {
        return islands_[island_[discs_[contact.one].body]];
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

/// A world step is solved tick by tick: drives are limited forces, which act per tick.
void DiscSolver::solve(const Island &island, const Islands &islands, double step_s) {
    const auto ticks = std::lround(step_s / TICK_S);
    for (int tick = 0; tick < ticks; tick++) {
        drive(island, islands, tick, step_s);
        find_active(island);
        separate_overlapping();
        solve_velocities();
        integrate(island);
    }
    for (const Disc &disc : discs_of(island)) {
        const auto &body = islands.bodies[disc.body];
        body.driven.velocity = disc.speed(mechanics_.radius_m);
        body.moved = {disc.at - body.pose.position, disc.rim_way / mechanics_.radius_m};
    }
}

void DiscSolver::drive(const Island &island, const Islands &islands, int tick, double step_s) {
    for (Disc &disc : discs_of(island)) {
        disc.changed_at = 1;
        if (disc.inverse_mass == 0) continue;
        const auto &body = islands.bodies[disc.body];
        DrivenBody &driven = body.driven;
        driven.velocity = disc.speed(mechanics_.radius_m);
        if (tick == 0)
            driven.drive(body.free.velocity(step_s), force_);
        else
            driven.drive_on(force_);
        disc.velocity = driven.velocity.by;
        disc.rim = driven.velocity.turn * mechanics_.radius_m;
    }
}

/// Finds the contacts that may close within this tick, and applies the last tick's impulses.
void DiscSolver::find_active(const Island &island) {
    active_.clear();
    overlapping_.clear();
    changes_ = 1;
    for (uint32_t i = 0; i < island.contacts; i++) {
        Contact &contact = contacts_[island.first_contact + i];
        const double gap_m = find_gap(contact);
        if (gap_m == INFINITY) {
            contact.normal_impulse = contact.tangent_impulse = 0;
            continue;
        }
        contact.closing_limit_m_s = max_of(gap_m, 0) * TICKS_PER_S;
        contact.solved_at = 0;
        active_.push_back(island.first_contact + i);
        if (contact.normal_impulse > 0)
            push(contact, contact.normal_impulse, contact.tangent_impulse);
        if (gap_m < -SLOP * mechanics_.radius_m) overlapping_.push_back(island.first_contact + i);
    }
}

/// Updates the normal. Returns the gap, or INFINITY if it cannot close in this tick.
double DiscSolver::find_gap(Contact &contact) const {
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
    if (distance > 0) contact.normal = apart / distance;
    return distance - 2 * mechanics_.radius_m;
}

/// Along the normal of the tick's begin.
double DiscSolver::gap_m(const Contact &contact) const {
    const double to_m = contact.normal.dot(discs_[contact.one].at);
    if (contact.other < WALLS) return contact.wall_m - to_m - mechanics_.radius_m;
    return contact.normal.dot(discs_[contact.other].at) - to_m - 2 * mechanics_.radius_m;
}

void DiscSolver::separate(const Contact &contact) {
    const double over_m = -gap_m(contact) - SLOP * mechanics_.radius_m;
    if (over_m <= 0) return;
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    const double most_m = mechanics_.part_m_s * TICK_S;
    const double way_m = std::min(over_m, most_m) / (one.inverse_mass + other.inverse_mass);
    one.at -= one.inverse_mass * way_m * contact.normal;
    other.at += other.inverse_mass * way_m * contact.normal;
}

/// Several rounds: a disc that is moved may overlap the next one.
void DiscSolver::separate_overlapping() {
    for (int round = 0; round < SEPARATIONS; round++)
        for (uint32_t i : overlapping_) separate(contacts_[i]);
}

void DiscSolver::solve_velocities() {
    for (int round = 0; round < ROUNDS; round++) {
        bool pushed = false;
        for (uint32_t i : active_) pushed |= solve_contact(contacts_[i]);
        if (!pushed) return;
    }
}

/// Updates the impulses of a contact. Returns whether they changed.
bool DiscSolver::solve_contact(Contact &contact) {
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    if (std::max(one.changed_at, other.changed_at) <= contact.solved_at) return false;
    contact.solved_at = changes_;
    const double share = 1 - one.inverse_mass * other.inverse_mass / 2;
    const Eigen::Vector2d closing = one.velocity - other.velocity;
    const Eigen::Vector2d tangent(-contact.normal.y(), contact.normal.x());
    const double excess = closing.dot(contact.normal) - contact.closing_limit_m_s;
    const double normal = max_of(contact.normal_impulse + share * excess, 0);
    if (normal == 0 && contact.normal_impulse == 0) return false;
    // At the rim, along the tangent, a disc resists with a third of its mass.
    const double slip = closing.dot(tangent) + one.rim + other.rim;
    const double most = FRICTION * normal;
    const double across = max_of(min_of(contact.tangent_impulse - share * slip / 3, most), -most);
    const double more = normal - contact.normal_impulse, rub = across - contact.tangent_impulse;
    if (std::abs(more) + std::abs(rub) <= TOLERANCE * mechanics_.part_m_s) return false;
    contact.normal_impulse = normal;
    contact.tangent_impulse = across;
    push(contact, more, rub);
    contact.solved_at = one.changed_at = ++changes_;
    if (contact.other >= WALLS) other.changed_at = changes_;
    return true;
}

/// Applies impulses to both discs; the inertia is m r^2 / 2.
void DiscSolver::push(const Contact &contact, double normal_impulse, double tangent_impulse) {
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    const Eigen::Vector2d tangent(-contact.normal.y(), contact.normal.x());
    const Eigen::Vector2d impulse = tangent_impulse * tangent - normal_impulse * contact.normal;
    one.velocity += one.inverse_mass * impulse;
    one.rim += one.inverse_mass * 2 * tangent_impulse;
    other.velocity -= other.inverse_mass * impulse;
    other.rim += other.inverse_mass * 2 * tangent_impulse;
}

void DiscSolver::integrate(const Island &island) {
    for (Disc &disc : discs_of(island)) {
        const double square = disc.velocity.squaredNorm();
        if (square > mechanics_.fastest_m_s * mechanics_.fastest_m_s)
            disc.velocity *= mechanics_.fastest_m_s / std::sqrt(square);
        disc.at += disc.velocity * TICK_S;
        disc.rim_way += disc.rim * TICK_S;
    }
}

}  // namespace kilotwin
