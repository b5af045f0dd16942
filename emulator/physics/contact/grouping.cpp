#include "physics/contact/grouping.h"

#include <algorithm>

namespace kilotwin {

namespace {

using Kind = ContactBody::Kind;

// A robot that slides along a wall in closed form may come nearer by this share of a radius.
constexpr double ROUNDING = 1e-3;

/// Unit vector from the first to the other.
Eigen::Vector2d normal_of(const std::vector<ContactBody> &bodies, const ContactPair &pair) {
    return (bodies[pair.other].pose.position - bodies[pair.one].pose.position) / pair.distance_m;
}

bool is_contact(const std::vector<ContactBody> &bodies, const ContactPair &pair) {
    return bodies[pair.one].kind == Kind::ROBOT && bodies[pair.one].other == pair.other;
}

}  // namespace

Grouping::Grouping(const Arena &arena, double radius_m, Team &team)
    : arena_(arena),
      radius_m_(radius_m),
      team_(team),
      strays_(team.size()) {}

uint32_t Grouping::group_of(uint32_t body) {
    while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
    return body;
}

void Grouping::join_groups(uint32_t one, uint32_t other) {
    const uint32_t a = group_of(one), b = group_of(other);
    const auto [first, second] = std::minmax(a, b);
    parents_[second] = first;
}

void Grouping::find_groups(const Crowd &crowd) {
    const size_t bodies = crowd.bodies.size();
    parents_.resize(bodies);
    groups_.resize(bodies);
    islands_.resize(bodies);
    uncertain_.resize(bodies);
    team_.share([&](uint32_t share) { join_own(crowd, share); });
    for (const Strays &strays : strays_)
        for (const ContactPair &pair : strays.across) join_groups(pair.one, pair.other);
    team_.share([&](uint32_t share) { find_strays(crowd, share); });
}

/// Joins the bodies of a share; pairs with other shares' bodies are left.
void Grouping::join_own(const Crowd &crowd, uint32_t share) {
    const auto &[begin, end, pairs] = crowd.shares[share];
    auto &across = strays_[share].across;
    across.clear();
    for (uint32_t i = begin; i < end; i++) parents_[i] = i;
    for (const ContactPair &pair : pairs)
        if (pair.other < end)
            join_groups(pair.one, pair.other);
        else
            across.push_back(pair);
}

/// Finds the groups of a share's bodies, now that all are joined.
void Grouping::find_strays(const Crowd &crowd, uint32_t share) {
    const auto &[begin, end, pairs] = crowd.shares[share];
    Strays &strays = strays_[share];
    strays.bodies.clear();
    strays.pairs.clear();
    for (uint32_t i = begin; i < end; i++) {
        uint32_t first = i;  // trees stay as they are: others look into them
        while (parents_[first] != first) first = parents_[first];
        groups_[i] = first;
        islands_[i] = uncertain_[i] = false;
        if (first < begin) strays.bodies.push_back(i);
    }
    if (strays.bodies.empty()) return;
    for (const ContactPair &pair : pairs)
        if (groups_[pair.one] < begin) strays.pairs.push_back(pair);
}

/// Makes a pair the contact of both.
void Grouping::join(Crowd &crowd, const ContactPair &pair, const Eigen::Vector2d &normal) const {
    ContactBody &one = crowd.bodies[pair.one], &other = crowd.bodies[pair.other];
    one.kind = other.kind = Kind::ROBOT;
    one.gap_m = other.gap_m = pair.distance_m - 2 * radius_m_;
    one.other = pair.other;
    other.other = pair.one;
    one.normal = normal;
    other.normal = -normal;
}

void Grouping::choose(Crowd &crowd, uint32_t share) {
    auto &bodies = crowd.bodies;
    for_each_body(crowd, share, [&](uint32_t i) {
        if (bodies[i].kind == Kind::ISLAND) islands_[groups_[i]] = true;
    });
    for_each_pair(crowd, share, [&](const ContactPair &pair) {
        ContactBody &one = bodies[pair.one], &other = bodies[pair.other];
        const Eigen::Vector2d normal = normal_of(bodies, pair);
        if (!ContactBody::meets(pair.distance_m - 2 * radius_m_, normal,
                                one.free.by - other.free.by, radius_m_))
            return;
        if (one.touches || other.touches) islands_[groups_[pair.one]] = true;
        one.touches = other.touches = true;
        join(crowd, pair, normal);
    });
    // A body that touches nothing yet may be touched by one that is near.
    for_each_pair(crowd, share, [&](const ContactPair &pair) {
        if (bodies[pair.one].kind == Kind::NONE && bodies[pair.other].kind == Kind::NONE)
            join(crowd, pair, normal_of(bodies, pair));
        if (!is_contact(bodies, pair)) uncertain_[groups_[pair.one]] = true;
    });
    for_each_body(crowd, share, [&](uint32_t i) {
        if (bodies[i].at_wall && (bodies[i].kind != Kind::WALL || !arena_.is_open()))
            uncertain_[groups_[i]] = true;
    });
    for_each_body(crowd, share, [&](uint32_t i) {
        const uint32_t group = groups_[i];
        if (islands_[group]) bodies[i].kind = Kind::ISLAND;
        bodies[i].uncertain = !islands_[group] && uncertain_[group];
    });
}

bool Grouping::find_missed(Crowd &crowd, uint32_t share) {
    auto &bodies = crowd.bodies;
    const double touch_m = 2 * radius_m_;
    bool found = false;
    auto miss = [&](uint32_t body) {
        islands_[groups_[body]] = true;
        found = true;
    };
    for_each_pair(crowd, share, [&](const ContactPair &pair) {
        const ContactBody &one = bodies[pair.one], &other = bodies[pair.other];
        if (!one.uncertain || is_contact(bodies, pair)) return;
        const Eigen::Vector2d apart =
            other.pose.position + other.moved.by - one.pose.position - one.moved.by;
        if (apart.squaredNorm() < touch_m * touch_m) miss(pair.one);
    });
    for_each_body(crowd, share, [&](uint32_t i) {
        const ContactBody &body = bodies[i];
        if (!body.uncertain || !body.at_wall) return;
        const double overlap_m = body.kind == Kind::WALL ? std::max(-body.gap_m, 0.0) : 0;
        const double least_m = (1 - ROUNDING) * radius_m_ - overlap_m;
        if (arena_.wall_gap(body.pose.position + body.moved.by) < least_m) miss(i);
    });
    if (!found) return false;
    for_each_body(crowd, share, [&](uint32_t i) {
        if (islands_[groups_[i]]) bodies[i].kind = Kind::ISLAND;
    });
    return true;
}

}  // namespace kilotwin
