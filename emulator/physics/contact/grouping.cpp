#include "physics/contact/grouping.h"

#include <algorithm>
#include <numeric>

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

Grouping::Grouping(const Arena &arena, double radius_m) : arena_(arena), radius_m_(radius_m) {}

uint32_t Grouping::group_of(uint32_t body) {
    while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
    return body;
}

void Grouping::join_groups(uint32_t one, uint32_t other) {
    const uint32_t a = group_of(one), b = group_of(other);
    const auto [first, second] = std::minmax(a, b);
    parents_[second] = first;
    islands_[first] |= islands_[second];
}

/// Makes a pair the contact of both.
void Grouping::join(std::vector<ContactBody> &bodies, const ContactPair &pair,
                    const Eigen::Vector2d &normal) {
    ContactBody &one = bodies[pair.one], &other = bodies[pair.other];
    one.kind = other.kind = Kind::ROBOT;
    one.gap_m = other.gap_m = pair.distance_m - 2 * radius_m_;
    one.other = pair.other;
    other.other = pair.one;
    one.normal = normal;
    other.normal = -normal;
}

void Grouping::choose(std::vector<ContactBody> &bodies, const std::vector<ContactPair> &pairs) {
    parents_.resize(bodies.size());
    std::iota(parents_.begin(), parents_.end(), 0);
    islands_.resize(bodies.size());
    uncertain_.assign(bodies.size(), false);
    for (size_t i = 0; i < bodies.size(); i++) islands_[i] = bodies[i].kind == Kind::ISLAND;
    for (const auto &pair : pairs) {
        join_groups(pair.one, pair.other);
        ContactBody &one = bodies[pair.one], &other = bodies[pair.other];
        const Eigen::Vector2d normal = normal_of(bodies, pair);
        if (!ContactBody::meets(pair.distance_m - 2 * radius_m_, normal,
                                one.free.by - other.free.by, radius_m_))
            continue;
        if (one.touches || other.touches) islands_[group_of(pair.one)] = true;
        one.touches = other.touches = true;
        join(bodies, pair, normal);
    }
    // A body that touches nothing yet may be touched by one that is near.
    for (const auto &pair : pairs) {
        if (bodies[pair.one].kind == Kind::NONE && bodies[pair.other].kind == Kind::NONE)
            join(bodies, pair, normal_of(bodies, pair));
        if (!is_contact(bodies, pair)) uncertain_[group_of(pair.one)] = true;
    }
    for (uint32_t i = 0; i < bodies.size(); i++)
        if (bodies[i].at_wall && (bodies[i].kind != Kind::WALL || !arena_.is_open()))
            uncertain_[group_of(i)] = true;
    for (uint32_t i = 0; i < bodies.size(); i++) {
        const uint32_t group = group_of(i);
        if (islands_[group]) bodies[i].kind = Kind::ISLAND;
        bodies[i].uncertain = !islands_[group] && uncertain_[group];
    }
}

bool Grouping::find_missed(std::vector<ContactBody> &bodies,
                           const std::vector<ContactPair> &pairs) {
    const double touch_m = 2 * radius_m_;
    bool found = false;
    auto miss = [&](uint32_t body) {
        islands_[group_of(body)] = true;
        found = true;
    };
    for (const auto &pair : pairs) {
        const ContactBody &one = bodies[pair.one], &other = bodies[pair.other];
        if (!one.uncertain || is_contact(bodies, pair)) continue;
        const Eigen::Vector2d apart =
            other.pose.position + other.moved.by - one.pose.position - one.moved.by;
        if (apart.squaredNorm() < touch_m * touch_m) miss(pair.one);
    }
    for (uint32_t i = 0; i < bodies.size(); i++) {
        const ContactBody &body = bodies[i];
        if (!body.uncertain || !body.at_wall) continue;
        const double overlap_m = body.kind == Kind::WALL ? std::max(-body.gap_m, 0.0) : 0;
        const double least_m = (1 - ROUNDING) * radius_m_ - overlap_m;
        if (arena_.wall_gap(body.pose.position + body.moved.by) < least_m) miss(i);
    }
    if (!found) return false;
    for (uint32_t i = 0; i < bodies.size(); i++)
        if (islands_[group_of(i)]) bodies[i].kind = Kind::ISLAND;
    return true;
}

}  // namespace kilotwin
