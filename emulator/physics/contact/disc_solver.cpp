#include "physics/contact/disc_solver.h"

#include <algorithm>
#include <cmath>

#include "base/clock.h"
#include "base/trigonometry.h"

namespace kilotwin {

namespace {

// As Box2D has them.
constexpr double HERTZ = 30, DAMPING_RATIO = 10;
constexpr double RATE_SHARE = 0.25;  // of the rate of sub-steps: no contact is stiffer than that

constexpr uint64_t WALL_KEY = uint64_t{1} << 63;  // walls come behind robots

/// A disc's rim goes three times as easily as its centre: inertia is m r^2 / 2.
constexpr double RIM_MOBILITY = 2;

Eigen::Vector2d across(const Eigen::Vector2d &normal) { return {normal.y(), -normal.x()}; }

}  // namespace

DiscSolver::Softness::Softness(double hertz, double sub_step_s) {
    const double omega = 2 * PI * hertz;
    const double a1 = 2 * DAMPING_RATIO + sub_step_s * omega, a2 = sub_step_s * omega * a1;
    impulse_share = 1 / (1 + a2);
    mass_share = a2 * impulse_share;
    rate_per_s = omega / a1;
}

void DiscSolver::solve(Islands &islands, double step_s) {
    if (islands.bodies.empty()) {
        kept_.clear();
        return;
    }
    const Division division = divide(islands, step_s, -1);
    const double round_s = step_s / division.rounds, sub_step_s = round_s / division.sub_steps;
    for (auto &body : islands.bodies)
        if (!body.fixed) body.driven.change_wanted(body.free.velocity(step_s));
    take_bodies(islands);
    for (int round = 0; round < division.rounds; round++) {
        set_drives(islands, sub_step_s);
        find_contacts(islands, round_s);
        for (int i = 0; i < division.sub_steps; i++) sub_step(sub_step_s);
        keep_impulses();
        for (size_t i = 0; i < islands.bodies.size(); i++)
            islands.bodies[i].driven.velocity = {discs_[i].velocity,
                                                 discs_[i].spin / mechanics_.radius_m};
    }
    give_back(islands);
}

void DiscSolver::forget(uint32_t robot) {
    const auto is_of = [robot](const Kept &kept) {
        const auto one = static_cast<uint32_t>((kept.key & ~WALL_KEY) >> 32);
        const bool is_wall = (kept.key & WALL_KEY) != 0;
        return one == robot || (!is_wall && static_cast<uint32_t>(kept.key) == robot);
    };
    kept_.erase(std::remove_if(kept_.begin(), kept_.end(), is_of), kept_.end());
}

void DiscSolver::take_bodies(const Islands &islands) {
    discs_.clear();
    for (const auto &body : islands.bodies) {
        const Shift &velocity = body.driven.velocity;
        discs_.push_back({velocity.by, Eigen::Vector2d(0, 0), velocity.turn * mechanics_.radius_m,
                          0, body.fixed ? 0.0 : 1.0});
    }
    discs_.push_back({Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0), 0, 0, 0});
}

void DiscSolver::set_drives(const Islands &islands, double sub_step_s) {
    drives_.clear();
    for (const auto &body : islands.bodies) {
        const auto rates = body.driven.rates(mechanics_, 1 / TICK_S);
        const Shift &wanted = body.driven.wanted;
        const double acts = body.fixed ? 0 : sub_step_s;
        drives_.push_back({wanted.by, wanted.turn * mechanics_.radius_m, acts * rates.by_per_s,
                           acts * rates.turn_per_s});
    }
}

void DiscSolver::find_contacts(const Islands &islands, double round_s) {
    contacts_.clear();
    keys_.clear();
    next_kept_ = 0;
    const double touch_m = 2 * mechanics_.radius_m;
    for (const auto &[one, other] : islands.pairs) {
        const auto &a = islands.bodies[one], &b = islands.bodies[other];
        const Eigen::Vector2d apart =
            b.pose.position - a.pose.position + discs_[other].way - discs_[one].way;
        const double distance_m = apart.norm();
        const Eigen::Vector2d normal =
            distance_m > 0 ? Eigen::Vector2d(apart / distance_m) : Eigen::Vector2d::UnitX();
        add_contact(one, other, normal, distance_m - touch_m,
                    static_cast<uint64_t>(a.robot) << 32 | b.robot);
    }
    find_walls(islands, round_s);
}

void DiscSolver::find_walls(const Islands &islands, double round_s) {
    const double seen_m = mechanics_.fastest_m_s * round_s;
    at_walls_.clear();
    for (uint32_t i = 0; i < islands.bodies.size(); i++) {
        const auto &body = islands.bodies[i];
        if (!body.at_wall) continue;
        const uint64_t key = WALL_KEY | static_cast<uint64_t>(body.robot) << 32;
        const auto meet = [&](double distance_m, const Eigen::Vector2d &outward, uint32_t wall) {
            const double gap_m = distance_m - mechanics_.radius_m;
            if (gap_m <= seen_m) at_walls_.push_back({key | wall, i, gap_m, outward});
        };
        arena_.for_each_wall(body.pose.position + discs_[i].way, mechanics_.radius_m + seen_m,
                             meet);
    }
    std::sort(at_walls_.begin(), at_walls_.end(),
              [](const AtWall &a, const AtWall &b) { return a.key < b.key; });
    for (const auto &[key, disc, gap_m, normal] : at_walls_)
        add_contact(disc, walls(), normal, gap_m, key);
}

// It goes on with the impulses that it had.
void DiscSolver::add_contact(uint32_t one, uint32_t other, const Eigen::Vector2d &normal,
                             double gap_m, uint64_t key) {
    const double mobility = discs_[one].mobility + discs_[other].mobility;
    if (mobility == 0) return;
    while (next_kept_ < kept_.size() && kept_[next_kept_].key < key) next_kept_++;
    const bool goes_on = next_kept_ < kept_.size() && kept_[next_kept_].key == key;
    const double gap_at_start_m = gap_m - normal.dot(discs_[other].way - discs_[one].way);
    contacts_.push_back({normal, gap_at_start_m, 1 / mobility,
                         goes_on ? kept_[next_kept_].impulses : Impulses{}, one, other});
    keys_.push_back(key);
}

void DiscSolver::keep_impulses() {
    kept_.clear();
    for (size_t i = 0; i < contacts_.size(); i++)
        if (contacts_[i].impulses.normal > 0) kept_.push_back({keys_[i], contacts_[i].impulses});
}

void DiscSolver::sub_step(double sub_step_s) {
    for (size_t i = 0; i < drives_.size(); i++) {
        const Drive &drive = drives_[i];
        Disc &disc = discs_[i];
        disc.velocity += drive.share * (drive.wanted - disc.velocity);
        disc.spin += drive.spin_share * (drive.spin - disc.spin);
    }
    warm_start();
    push_apart(sub_step_s);
    const double most = mechanics_.fastest_m_s;
    for (size_t i = 0; i < drives_.size(); i++) {
        Disc &disc = discs_[i];
        const double square = disc.velocity.squaredNorm();
        if (square > most * most) disc.velocity *= most / std::sqrt(square);
        disc.way += sub_step_s * disc.velocity;
        disc.rim_way += sub_step_s * disc.spin;
    }
    relax(sub_step_s);
}

inline void DiscSolver::push(Contact &contact, double impulse) {
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    one.velocity -= impulse * one.mobility * contact.normal;
    other.velocity += impulse * other.mobility * contact.normal;
}

inline void DiscSolver::rub(Contact &contact, double impulse) {
    Disc &one = discs_[contact.one], &other = discs_[contact.other];
    const Eigen::Vector2d along = across(contact.normal);
    one.velocity -= impulse * one.mobility * along;
    one.spin += impulse * one.mobility * RIM_MOBILITY;
    other.velocity += impulse * other.mobility * along;
    other.spin += impulse * other.mobility * RIM_MOBILITY;
}

void DiscSolver::warm_start() {
    for (Contact &contact : contacts_) {
        if (contact.impulses.normal == 0) continue;
        push(contact, contact.impulses.normal);
        rub(contact, contact.impulses.friction);
    }
}

void DiscSolver::push_apart(double sub_step_s) {
    const double hertz = std::min(HERTZ, RATE_SHARE / sub_step_s);
    const Softness of_two(hertz, sub_step_s), of_fixed(2 * hertz, sub_step_s);
    // Relaxing goes the other way round: an impulse passes along a row in either direction.
    for (size_t i = contacts_.size(); i-- > 0;) {
        Contact &contact = contacts_[i];
        const Disc &one = discs_[contact.one], &other = discs_[contact.other];
        const double gap_m = gap_now_m(contact);
        const double closing = contact.normal.dot(other.velocity - one.velocity);
        double impulse;
        if (gap_m > 0) {
            impulse = -contact.mass * (closing + gap_m / sub_step_s);
        } else {
            const Softness &soft = contact.mass < 1 ? of_two : of_fixed;
            const double bias = std::max(soft.rate_per_s * gap_m, -mechanics_.part_m_s);
            impulse = -contact.mass * soft.mass_share * (closing + bias) -
                      soft.impulse_share * contact.impulses.normal;
        }
        const double before = contact.impulses.normal;
        contact.impulses.normal = std::max(before + impulse, 0.0);
        push(contact, contact.impulses.normal - before);
    }
}

void DiscSolver::relax(double sub_step_s) {
    for (Contact &contact : contacts_) {
        const double gap_m = gap_now_m(contact), before = contact.impulses.normal;
        const double closing =
            contact.normal.dot(discs_[contact.other].velocity - discs_[contact.one].velocity);
        const double impulse = -contact.mass * (closing + std::max(gap_m, 0.0) / sub_step_s);
        contact.impulses.normal = std::max(before + impulse, 0.0);
        push(contact, contact.impulses.normal - before);
        if (contact.impulses.normal == 0 && contact.impulses.friction == 0) continue;
        const Disc &one = discs_[contact.one], &other = discs_[contact.other];
        const double slip =
            across(contact.normal).dot(other.velocity - one.velocity) + one.spin + other.spin;
        const double most = FRICTION * contact.impulses.normal, had = contact.impulses.friction;
        contact.impulses.friction =
            std::clamp(had - contact.mass / (1 + RIM_MOBILITY) * slip, -most, most);
        rub(contact, contact.impulses.friction - had);
    }
}

void DiscSolver::give_back(Islands &islands) {
    for (size_t i = 0; i < islands.bodies.size(); i++) {
        auto &body = islands.bodies[i];
        const Disc &disc = discs_[i];
        body.moved = {disc.way, disc.rim_way / mechanics_.radius_m};
        if (!body.at_wall || body.fixed) continue;
        const Eigen::Vector2d at = body.pose.position + disc.way, kept = kept_off_walls(at);
        if (kept != at) body.moved.by = kept - body.pose.position;
    }
}

}  // namespace kilotwin
