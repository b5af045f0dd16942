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

void DiscSolver::solve(std::vector<Islands> &islands, double step_s) {
    const auto is_empty = [](const Islands &one) { return one.bodies.empty(); };
    if (std::all_of(islands.begin(), islands.end(), is_empty)) {
        kept_.clear();
        return;
    }
    team_.share([&](uint32_t share) {
        shares_[share].closeness = closeness(islands[share], -1);
        take_bodies(shares_[share], islands[share], step_s);
    });
    Closeness all;
    for (const Share &share : shares_) all.add(share.closeness);
    const Division division = divide(all, step_s, false);
    team_.share(
        [&](uint32_t share) { solve_share(shares_[share], islands[share], division, step_s); });
    merge_kept();
}

void DiscSolver::solve_share(Share &share, Islands &islands, const Division &division,
                             double step_s) const {
    const double round_s = step_s / division.rounds, sub_step_s = round_s / division.sub_steps;
    for (int round = 0; round < division.rounds; round++) {
        set_drives(share, islands, sub_step_s);
        find_contacts(share, islands, round_s, round == 0 ? kept_ : share.kept);
        for (int i = 0; i < division.sub_steps; i++) {
            share.drive();
            share.warm_start();
            share.push_apart(sub_step_s, mechanics_.part_m_s);
            share.go_on(sub_step_s, mechanics_.fastest_m_s);
            share.relax(sub_step_s);
        }
        keep_impulses(share);
        for (size_t i = 0; i < islands.bodies.size(); i++)
            islands.bodies[i].driven.velocity = {share.discs[i].velocity,
                                                 share.discs[i].spin / mechanics_.radius_m};
    }
    give_back(share, islands);
}

/// The impulses that the shares keep, as one list.
void DiscSolver::merge_kept() {
    if (shares_.size() == 1) return kept_.swap(shares_[0].kept);
    kept_.clear();
    const auto before = [](const Kept &a, const Kept &b) { return a.key < b.key; };
    const auto is_wall = [](const Kept &kept) { return (kept.key & WALL_KEY) != 0; };
    const auto append = [&](auto begin, auto end) {
        const auto old = static_cast<ptrdiff_t>(kept_.size());
        kept_.insert(kept_.end(), begin, end);
        std::inplace_merge(kept_.begin(), kept_.begin() + old, kept_.end(), before);
    };
    for (const Share &share : shares_)
        append(share.kept.begin(), std::find_if(share.kept.begin(), share.kept.end(), is_wall));
    for (const Share &share : shares_)
        append(std::find_if(share.kept.begin(), share.kept.end(), is_wall), share.kept.end());
}

void DiscSolver::forget(uint32_t robot) {
    const auto is_of = [robot](const Kept &kept) {
        const auto one = static_cast<uint32_t>((kept.key & ~WALL_KEY) >> 32);
        const bool is_wall = (kept.key & WALL_KEY) != 0;
        return one == robot || (!is_wall && static_cast<uint32_t>(kept.key) == robot);
    };
    kept_.erase(std::remove_if(kept_.begin(), kept_.end(), is_of), kept_.end());
}

void DiscSolver::take_bodies(Share &share, Islands &islands, double step_s) const {
    share.discs.clear();
    for (auto &body : islands.bodies) {
        if (!body.fixed) body.driven.change_wanted(body.free.velocity(step_s));
        const Shift &velocity = body.driven.velocity;
        share.discs.push_back({velocity.by, Eigen::Vector2d(0, 0),
                               velocity.turn * mechanics_.radius_m, 0, body.fixed ? 0.0 : 1.0});
    }
    share.discs.push_back({Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0), 0, 0, 0});
}

void DiscSolver::set_drives(Share &share, const Islands &islands, double sub_step_s) const {
    share.drives.clear();
    for (const auto &body : islands.bodies) {
        const auto rates = body.driven.rates(mechanics_, 1 / TICK_S);
        const Shift &wanted = body.driven.wanted;
        const double acts = body.fixed ? 0 : sub_step_s;
        share.drives.push_back({wanted.by, wanted.turn * mechanics_.radius_m, acts * rates.by_per_s,
                                acts * rates.turn_per_s});
    }
}

void DiscSolver::find_contacts(Share &share, const Islands &islands, double round_s,
                               const std::vector<Kept> &kept) const {
    share.contacts.clear();
    share.keys.clear();
    KeptSoFar kept_so_far{kept};
    const double touch_m = 2 * mechanics_.radius_m;
    for (const auto &[one, other] : islands.pairs) {
        const auto &a = islands.bodies[one], &b = islands.bodies[other];
        const Eigen::Vector2d apart =
            b.pose.position - a.pose.position + share.discs[other].way - share.discs[one].way;
        const double distance_m = apart.norm();
        const Eigen::Vector2d normal =
            distance_m > 0 ? Eigen::Vector2d(apart / distance_m) : Eigen::Vector2d::UnitX();
        add_contact(share, one, other, normal, distance_m - touch_m,
                    static_cast<uint64_t>(a.robot) << 32 | b.robot, kept_so_far);
    }
    find_walls(share, islands, round_s, kept_so_far);
}

void DiscSolver::find_walls(Share &share, const Islands &islands, double round_s,
                            KeptSoFar &kept) const {
    const double seen_m = mechanics_.fastest_m_s * round_s;
    share.at_walls.clear();
    for (uint32_t i = 0; i < islands.bodies.size(); i++) {
        const auto &body = islands.bodies[i];
        if (!body.at_wall) continue;
        const uint64_t key = WALL_KEY | static_cast<uint64_t>(body.robot) << 32;
        const auto meet = [&](double distance_m, const Eigen::Vector2d &outward, uint32_t wall) {
            const double gap_m = distance_m - mechanics_.radius_m;
            if (gap_m <= seen_m) share.at_walls.push_back({key | wall, i, gap_m, outward});
        };
        arena_.for_each_wall(body.pose.position + share.discs[i].way, mechanics_.radius_m + seen_m,
                             meet);
    }
    std::sort(share.at_walls.begin(), share.at_walls.end(),
              [](const AtWall &a, const AtWall &b) { return a.key < b.key; });
    for (const auto &[key, disc, gap_m, normal] : share.at_walls)
        add_contact(share, disc, share.walls(), normal, gap_m, key, kept);
}

DiscSolver::Impulses DiscSolver::KeptSoFar::of(uint64_t key) {
    while (next < kept.size() && kept[next].key < key) next++;
    return next < kept.size() && kept[next].key == key ? kept[next].impulses : Impulses{};
}

// It goes on with the impulses that it had.
void DiscSolver::add_contact(Share &share, uint32_t one, uint32_t other,
                             const Eigen::Vector2d &normal, double gap_m, uint64_t key,
                             KeptSoFar &kept) {
    const auto &discs = share.discs;
    const double mobility = discs[one].mobility + discs[other].mobility;
    if (mobility == 0) return;
    const double gap_at_start_m = gap_m - normal.dot(discs[other].way - discs[one].way);
    share.contacts.push_back({normal, gap_at_start_m, 1 / mobility, kept.of(key), one, other});
    share.keys.push_back(key);
}

void DiscSolver::keep_impulses(Share &share) {
    share.kept.clear();
    for (size_t i = 0; i < share.contacts.size(); i++) {
        const Impulses &impulses = share.contacts[i].impulses;
        if (impulses.normal > 0) share.kept.push_back({share.keys[i], impulses});
    }
}

void DiscSolver::Share::drive() {
    for (size_t i = 0; i < drives.size(); i++) {
        const Drive &drive = drives[i];
        Disc &disc = discs[i];
        disc.velocity += drive.share * (drive.wanted - disc.velocity);
        disc.spin += drive.spin_share * (drive.spin - disc.spin);
    }
}

void DiscSolver::Share::go_on(double sub_step_s, double fastest_m_s) {
    for (size_t i = 0; i < drives.size(); i++) {
        Disc &disc = discs[i];
        const double square = disc.velocity.squaredNorm();
        if (square > fastest_m_s * fastest_m_s) disc.velocity *= fastest_m_s / std::sqrt(square);
        disc.way += sub_step_s * disc.velocity;
        disc.rim_way += sub_step_s * disc.spin;
    }
}

inline void DiscSolver::Share::push(Contact &contact, double impulse) {
    Disc &one = discs[contact.one], &other = discs[contact.other];
    one.velocity -= impulse * one.mobility * contact.normal;
    other.velocity += impulse * other.mobility * contact.normal;
}

inline void DiscSolver::Share::rub(Contact &contact, double impulse) {
    Disc &one = discs[contact.one], &other = discs[contact.other];
    const Eigen::Vector2d along = across(contact.normal);
    one.velocity -= impulse * one.mobility * along;
    one.spin += impulse * one.mobility * RIM_MOBILITY;
    other.velocity += impulse * other.mobility * along;
    other.spin += impulse * other.mobility * RIM_MOBILITY;
}

void DiscSolver::Share::warm_start() {
    for (Contact &contact : contacts) {
        if (contact.impulses.normal == 0) continue;
        push(contact, contact.impulses.normal);
        rub(contact, contact.impulses.friction);
    }
}

void DiscSolver::Share::push_apart(double sub_step_s, double part_m_s) {
    const double hertz = std::min(HERTZ, RATE_SHARE / sub_step_s);
    const Softness of_two(hertz, sub_step_s), of_fixed(2 * hertz, sub_step_s);
    // Relaxing goes the other way round: an impulse passes along a row in either direction.
    for (size_t i = contacts.size(); i-- > 0;) {
        Contact &contact = contacts[i];
        const Disc &one = discs[contact.one], &other = discs[contact.other];
        const double gap_m = gap_now_m(contact);
        const double closing = contact.normal.dot(other.velocity - one.velocity);
        double impulse;
        if (gap_m > 0) {
            impulse = -contact.mass * (closing + gap_m / sub_step_s);
        } else {
            const Softness &soft = contact.mass < 1 ? of_two : of_fixed;
            const double bias = std::max(soft.rate_per_s * gap_m, -part_m_s);
            impulse = -contact.mass * soft.mass_share * (closing + bias) -
                      soft.impulse_share * contact.impulses.normal;
        }
        const double before = contact.impulses.normal;
        contact.impulses.normal = std::max(before + impulse, 0.0);
        push(contact, contact.impulses.normal - before);
    }
}

void DiscSolver::Share::relax(double sub_step_s) {
    for (Contact &contact : contacts) {
        const double gap_m = gap_now_m(contact), before = contact.impulses.normal;
        const double closing =
            contact.normal.dot(discs[contact.other].velocity - discs[contact.one].velocity);
        const double impulse = -contact.mass * (closing + std::max(gap_m, 0.0) / sub_step_s);
        contact.impulses.normal = std::max(before + impulse, 0.0);
        push(contact, contact.impulses.normal - before);
        if (contact.impulses.normal == 0 && contact.impulses.friction == 0) continue;
        const Disc &one = discs[contact.one], &other = discs[contact.other];
        const double slip =
            across(contact.normal).dot(other.velocity - one.velocity) + one.spin + other.spin;
        const double most = FRICTION * contact.impulses.normal, had = contact.impulses.friction;
        contact.impulses.friction =
            std::clamp(had - contact.mass / (1 + RIM_MOBILITY) * slip, -most, most);
        rub(contact, contact.impulses.friction - had);
    }
}

void DiscSolver::give_back(const Share &share, Islands &islands) const {
    for (size_t i = 0; i < islands.bodies.size(); i++) {
        auto &body = islands.bodies[i];
        const Disc &disc = share.discs[i];
        body.moved = {disc.way, disc.rim_way / mechanics_.radius_m};
        if (!body.at_wall || body.fixed) continue;
        const Eigen::Vector2d at = body.pose.position + disc.way, kept = kept_off_walls(at);
        if (kept != at) body.moved.by = kept - body.pose.position;
    }
}

}  // namespace kilotwin
