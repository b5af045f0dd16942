// Bodies: which robots may touch something in a step, and what becomes of them.
#include <algorithm>
#include <cmath>

#include "base/trigonometry.h"
#include "physics/bodies.h"

namespace kilotwin {

namespace {

constexpr double CANDIDATE_GAP = 2;          // of a radius: gap up to which robots are candidates
constexpr uint8_t STEPS_APART_TO_LEAVE = 2;  // then a robot is free again

}  // namespace

void Bodies::find_candidates(uint32_t robot) {
    auto &[until, robots, before_number, body_number] = candidates_[robot];
    const auto list = lists_.of(robot);
    robots.resize(list.size());
    const Eigen::Vector2d here = position(robot);
    const double near_m = 2 * radius_m_ + std::max(CANDIDATE_GAP * radius_m_, 3 * contact_gap_m_);
    double outside = INFINITY;
    size_t found = 0;
    for (uint32_t other : list) {
        const double square = (position(other) - here).squaredNorm();
        const bool near = square <= near_m * near_m;
        robots[found] = other;
        found += near;
        outside = std::min(outside, near ? INFINITY : square);
    }
    robots.resize(found);
    const double gap = std::sqrt(outside) - contact_reach_m();
    until = std::min(std::max(lists_hold_until_, now_ + step_) + unlisted_for_,
                     now_ + whole_steps(std::min(gap / (2 * fastest_m_s_), 1e6), step_));
}

/// Prefetches what may_touch() needs of robots after the i-th.
void Bodies::prefetch_near_after(const Share &share, size_t i) const {
    constexpr size_t SOON = 4, LATER = 8, LATEST = 12;
    if (!prefetches(size()) || i + LATEST >= share.near_contact.size()) return;
    for (uint32_t other : candidates_[share.near_contact[i + SOON]].robots) prefetch_place(other);
    const uint32_t latest = share.near_contact[i + LATEST];
    prefetch_object(trajectories_[latest]);
    prefetch_line(&candidates_[latest]);
    lists_.prefetch_place(latest);
    lists_.prefetch(share.near_contact[i + LATER]);
}

/// The same of for_each_touched().
void Bodies::prefetch_touching_after(const Share &share, size_t i) const {
    constexpr size_t SOON = 5, LATER = 10;
    if (!prefetches(size()) || i + LATER >= share.touching.size()) return;
    for (uint32_t other : candidates_[share.touching[i + SOON]].robots) prefetch_place(other);
    prefetch_line(&candidates_[share.touching[i + LATER]]);
}

/// The same of fill_body().
void Bodies::prefetch_held_after(const Share &share, size_t i) const {
    constexpr size_t LATER = 12;
    if (!prefetches(size()) || i + LATER >= share.held.size()) return;
    const uint32_t later = share.held[i + LATER].robot;
    prefetch_line(&candidates_[later]);
    prefetch_object(trajectories_[later]);
}

/// Finds the robots that may touch a body or a wall within this step, and all that those may push
/// in turn.
void Bodies::find_contacts() {
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        find_touching(shares_[share], begin, end);
    });
    double square = 0;
    for (const Share &share : shares_) square = std::max(square, share.shift_square);
    longest_shift_m_ = std::max(longest_shift_m_, std::sqrt(square));
    team_.share([this](uint32_t share) { find_touched(shares_[share]); });
    // One by one, in the order of robots: each that is taken in may be faster than all before.
    added_.clear();
    next_added_ = 0;
    for (const Share &share : shares_)
        for (const Pair &aside : share.asides) add_touched(aside);
    add_all_touched();
    if (objects_.empty()) return;
    find_near_objects();
    while (include_objects()) add_all_touched();
}

/// Looks at robots one by one. What is found of one does not depend on what is found of others.
void Bodies::find_touching(Share &share, size_t begin, size_t end) {
    choose(share.near_contact, begin, end,
           [this](uint32_t robot) { return next_contact_[robot] <= now_; });
    share.touching.clear();
    share.shift_square = 0;
    for (size_t i = 0; i < share.near_contact.size(); i++) {
        prefetch_near_after(share, i);
        const uint32_t robot = share.near_contact[i];
        if (!may_touch(robot)) continue;
        is_touching_[robot] = true;
        share.touching.push_back(robot);
        share.shift_square = std::max(share.shift_square, free_path(robot).squaredNorm());
    }
}

/// Calls `visit` for each pair of a robot that touches with another that it may touch.
template <typename Visit> void Bodies::for_each_touched(uint32_t robot, Visit visit) {
    const Eigen::Vector2d here = position(robot);
    const double reach = contact_reach_m();
    for (uint32_t other : candidates(robot)) {
        if (is_touching_[other] && other < robot) continue;  // the other one has the pair
        const double square = (position(other) - here).squaredNorm();
        if (square <= reach * reach) visit(Pair{robot, other, std::sqrt(square)});
    }
}

/// Finds what the robots of a share that touch may touch, by what is known of all robots so far.
void Bodies::find_touched(Share &share) {
    share.pairs.clear();
    share.asides.clear();
    for (size_t i = 0; i < share.touching.size(); i++) {
        prefetch_touching_after(share, i);
        for_each_touched(share.touching[i], [&](const Pair &pair) {
            (is_touching_[pair.other] ? share.pairs : share.asides).push_back(pair);
        });
    }
}

/// A robot touches though that was not found when it was looked at alone.
void Bodies::add_touching(uint32_t robot) {
    is_touching_[robot] = true;
    added_.push_back(robot);
    const double square = free_path(robot).squaredNorm();
    if (square > longest_shift_m_ * longest_shift_m_)
        longest_shift_m_ = std::max(longest_shift_m_, std::sqrt(square));
}

/// Whether a robot moves and may touch something within this step. If not, sets next_contact_.
bool Bodies::may_touch(uint32_t robot) {
    const Eigen::Vector2d here = position(robot);
    const Cycles change = next_change_[robot];
    if (stays(robot)) {
        next_contact_[robot] = change == NEVER ? NEVER : begin_of_step(change, step_);
        return false;
    }
    const auto &others = candidates(robot);
    const double wall_gap = arena_.wall_gap(here) - radius_m_;
    next_contact_[robot] = now_ + step_;
    if (wall_gap <= contact_gap_m_ && would_touch_wall(robot, wall_gap)) return true;
    const double reach = contact_reach_m();
    double nearest = INFINITY;
    for (uint32_t other : others) {
        const double square = (position(other) - here).squaredNorm();
        if (square <= reach * reach && would_touch(robot, other)) return true;
        nearest = std::min(nearest, square);
    }
    const double free_m = std::min((std::sqrt(nearest) - reach) / 2, wall_gap - contact_gap_m_);
    const double free_s = std::min(free_m / fastest_m_s_, 1e6);
    next_contact_[robot] =
        std::clamp(now_ + whole_steps(free_s, step_), now_ + step_, candidates_[robot].until);
    return false;
}

/// Bound of a robot's way within this step.
double Bodies::longest_free_m(uint32_t robot) const {
    const bool steady = !has_changed(robot) && next_change_[robot] >= now_ + step_;
    return seconds(step_) * (steady ? speeds_[robot] : fastest_m_s_);
}

/// Whether two robots within contact reach would touch, both going on as they do.
bool Bodies::would_touch(uint32_t robot, uint32_t other) const {
    const Eigen::Vector2d apart = position(other) - position(robot);
    const double touch = 2 * radius_m_ + margin_m_, square = apart.squaredNorm();
    if (is_held_[other]) {  // it may be pushed anywhere
        if (square <= touch * touch) return true;
        return std::sqrt(square) <= touch + free_path(robot).norm() + longest_shift_m_;
    }
    const double reach = touch + longest_free_m(robot) + longest_free_m(other);
    if (square > reach * reach) return false;
    const Eigen::Vector2d way = free_path(robot);
    const Eigen::Vector2d closing = free_path(other) - way;
    const double approach = -apart.dot(closing);
    if (approach <= 0) return false;
    const double part = std::min(approach / closing.squaredNorm(), 1.0);
    return (apart + part * closing).squaredNorm() <= touch * touch;
}

/// `wall_gap_m`: of the robot's rim when the step begins.
bool Bodies::would_touch_wall(uint32_t robot, double wall_gap_m) const {
    const Eigen::Vector2d &there = next_places_[robot];
    const double then_m = arena_.wall_gap(there);
    if (arena_.is_open()) return then_m <= radius_m_ + margin_m_;
    // It may come nearer on its way than at either end, by half of what the way is longer.
    return (wall_gap_m + then_m - radius_m_ - longest_free_m(robot)) / 2 <= margin_m_;
}

/// Looks at what robots may touch that were added, which adds more.
void Bodies::add_all_touched() {
    for (; next_added_ < added_.size(); next_added_++)
        for_each_touched(added_[next_added_], [this](const Pair &pair) { add_touched(pair); });
}

/// Adds a robot that one that touches may touch, moving as fast as the fastest of all.
void Bodies::add_touched(const Pair &pair) {
    const auto [robot, other, distance_m] = pair;
    if (!is_touching_[other]) {
        const double closing_m = longest_shift_m_ + free_path(other).norm();
        if (distance_m - 2 * radius_m_ > closing_m + margin_m_) return;
        add_touching(other);
    }
    if (robot < other) shares_[team_.share_of(robot, size())].pairs.push_back(pair);
}

/// Holds robots that touch, and lets go those that have touched nothing for some steps.
void Bodies::update_contacts() {
    for (const uint32_t robot : added_)
        shares_[team_.share_of(robot, size())].touching.push_back(robot);
    team_.share(
        [this](uint32_t share) { hold_touching(shares_[share], crowd_.shares[share].begin); });
    size_t bodies = 0;
    for (size_t i = 0; i < shares_.size(); i++) {
        crowd_.shares[i].begin = static_cast<uint32_t>(bodies);
        bodies += shares_[i].held.size();
        crowd_.shares[i].end = static_cast<uint32_t>(bodies);
    }
    crowd_.bodies.resize(bodies);
    crowd_.driven.swap(driven_so_far_);
    crowd_.driven.resize(bodies);
}

/// Those of a share, whose bodies had positions from `last_number` on.
void Bodies::hold_touching(Share &share, uint32_t last_number) {
    sort_tail(share.touching);
    sort_tail(share.pairs);
    share.held_so_far.swap(share.held);
    share.held.clear();
    auto touching = share.touching.begin();
    const auto take_up_to = [&](uint32_t limit) {
        for (; touching != share.touching.end() && *touching < limit; ++touching) {
            is_held_[*touching] = true;
            steps_apart_[*touching] = 0;
            share.held.push_back({*touching, Held::NEW});
        }
    };
    for (const auto &[robot, before] : share.held_so_far) {
        const uint32_t number = last_number++;
        take_up_to(robot);
        if (!is_held_[robot]) continue;  // it was placed elsewhere
        if (touching != share.touching.end() && *touching == robot) {
            ++touching;
            steps_apart_[robot] = 0;
        } else if (++steps_apart_[robot] >= STEPS_APART_TO_LEAVE) {
            is_held_[robot] = false;
            continue;
        }
        share.held.push_back({robot, number});
    }
    take_up_to(UINT32_MAX);
    for (const uint32_t robot : share.touching) is_touching_[robot] = false;
}

void Bodies::step_contacts() {
    pushed_.clear();
    take_pushed_objects();
    if (crowd_.bodies.empty() && pushed_objects_.empty()) {
        longest_shift_m_ = 0;
        return;
    }
    team_.share(
        [this](uint32_t share) { fill_bodies(shares_[share], crowd_.shares[share].begin); });
    team_.share([this](uint32_t share) { find_body_pairs(shares_[share], crowd_.shares[share]); });
    contacts_.step(crowd_, pushed_objects_, seconds(step_));
    solver_steps_ += crowd_.bodies.size();
    team_.share([this](uint32_t share) { take_all_moved(shares_[share], crowd_.shares[share]); });
    double square = 0;
    for (const Share &share : shares_) {
        square = std::max(square, share.shift_square);
        pushed_.insert(pushed_.end(), share.pushed.begin(), share.pushed.end());
    }
    longest_shift_m_ = std::sqrt(square);
    for (const auto &[object, state] : pushed_objects_)
        longest_shift_m_ = std::max(longest_shift_m_,
                                    seconds(step_) * state.most_m_s(objects_[object].radius_m()));
    team_.share([this](uint32_t number) {
        Share &share = shares_[number];
        const double touch = 2 * radius_m_;
        for (const auto &[one, other, distance_m] : share.pairs) {
            const double apart = (next_places_[other] - next_places_[one]).squaredNorm();
            if (apart < touch * touch) record_overlap(share, std::sqrt(apart) - touch);
        }
    });
}

/// Makes the bodies of a share's robots, from position `number` on.
void Bodies::fill_bodies(const Share &share, uint32_t number) {
    for (size_t i = 0; i < share.held.size(); i++) {
        prefetch_held_after(share, i);
        const auto &[robot, last_number] = share.held[i];
        candidates_[robot].body_number = number;
        const Going now = going(robot);
        crowd_.driven[number] = last_number == Held::NEW
                                    ? Contacts::driven_as(now.heading, now.drive)
                                    : driven_so_far_[last_number];
        fill_body(crowd_.bodies[number++], robot, now.heading);
    }
}

/// A robot as it would go if nothing touched it.
void Bodies::fill_body(ContactBody &body, uint32_t robot, double heading) {
    const double then = trajectories_[robot].heading(now_ + step_);
    body.robot = robot;
    body.free = {free_path(robot), wrapped(then - heading)};
    body.pose = {places_[robot], heading};
    find_wall_contacts(body);
    if (!at_object_.empty() && at_object_[robot]) body.kind = ContactBody::Kind::ISLAND;
}

void Bodies::take_all_moved(Share &share, const Crowd::Share &crowd) {
    share.pushed.clear();
    share.shift_square = 0;
    for (uint32_t i = crowd.begin; i < crowd.end; i++) {
        ContactBody &body = crowd_.bodies[i];
        take_moved(body, now_ + step_);
        const auto &[by, turn] = body.moved;
        share.shift_square =
            std::max({share.shift_square, by.squaredNorm(), body.free.by.squaredNorm()});
        if (by.x() != 0 || by.y() != 0 || turn != 0) share.pushed.push_back(body.robot);
        record_overlap(share, body.gap_m);
    }
}

/// Restarts the trajectory of a robot that is held where the step ended. Its body's gap is that
/// to the walls from there on.
void Bodies::take_moved(ContactBody &body, Cycles end) {
    const uint32_t robot = body.robot;
    const auto &[by, turn] = body.moved;
    Trajectory &trajectory = trajectories_[robot];
    const bool moved = by.x() != 0 || by.y() != 0;
    if (moved) still_since_[robot] = trajectory.drive().stands() ? end : NEVER;
    const Pose pose = {body.pose.position + by, wrapped(body.pose.heading + turn)};
    trajectory.restart(end, pose);
    next_places_[robot] = pose.position;
    body.gap_m = arena_.wall_gap(pose.position) - radius_m_;
}

/// Finds which robots that are held may touch each other within this step: those of a share.
void Bodies::find_body_pairs(const Share &share, Crowd::Share &crowd) const {
    // A pushed robot moves no farther than the fastest of those that push it.
    const double most_m = 2 * longest_shift_m_ + margin_m_;
    crowd.pairs.clear();
    for (const auto &[one, other, distance_m] : share.pairs)
        if (distance_m - 2 * radius_m_ <= most_m)
            crowd.pairs.push_back(
                {candidates_[one].body_number, candidates_[other].body_number, distance_m});
}

void Bodies::find_wall_contacts(ContactBody &body) const {
    using Kind = ContactBody::Kind;
    const double most_m = fastest_m_s_ * seconds(step_);
    body.kind = Kind::NONE;
    body.at_wall = body.touches = false;
    if (arena_.wall_gap(body.pose.position) - radius_m_ > most_m) return;
    auto meet = [&](double distance, const Eigen::Vector2d &outward, uint32_t /*wall*/) {
        if (distance - radius_m_ > most_m) return;
        body.kind = body.kind == Kind::NONE ? Kind::WALL : Kind::ISLAND;
        body.at_wall = true;
        body.normal = outward;
        body.gap_m = distance - radius_m_;
        body.touches = ContactBody::meets(body.gap_m, outward, body.free.by, radius_m_);
    };
    arena_.for_each_wall(body.pose.position, radius_m_ + most_m, meet);
}

void Bodies::record_overlap(Share &share, double gap_m) const {
    if (gap_m < 0) share.overlaps.add(-gap_m / (2 * radius_m_));
}

}  // namespace kilotwin
