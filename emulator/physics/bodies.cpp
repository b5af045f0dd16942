#include "physics/bodies.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/trigonometry.h"

namespace kilotwin {

namespace {

constexpr double SKIN_SHARE = 0.6;  // of the lists' reach, but at least so many steps of driving:
constexpr double SKIN_STEPS = 10;
constexpr double SKIN_USED =
    0.6;  // of the skin, before new lists are made: the rest is for running ahead
constexpr double CONTACT_MARGIN = 0.03;  // of a radius
constexpr double NEAR = 1;               // of a radius: gap up to which others count as near
constexpr uint8_t STEPS_APART_TO_LEAVE = 2;
// A robot that is pushed may be a little faster than it drives: the solver's own limit, relative to
// the fastest drive.
constexpr double PUSHED_SPEED = 1.1;

}  // namespace

Bodies::Bodies(const Arena &arena, const Profile &profile, const Chance &chance, Cycles step,
               Cycles begin, const std::vector<Pose> &poses, double reach_m, SolverKind solver)
    : arena_(arena),
      radius_m_(profile.radius_m),
      margin_m_(CONTACT_MARGIN * profile.radius_m),
      step_(step),
      now_(begin),
      chassis_(profile, chance, poses.size()),
      fastest_m_s_(PUSHED_SPEED * chassis_.fastest_m_s()),
      contact_gap_m_(2 * fastest_m_s_ * seconds(step) + margin_m_),
      unlisted_for_(whole_steps(
          (std::max(reach_m, contact_reach_m()) - contact_reach_m()) / (2 * fastest_m_s_), step)),
      world_(arena, profile, solver, chassis_.fastest_m_s(), fastest_m_s_, poses.size()),
      lists_(std::max(reach_m, contact_reach_m()),
             std::max(SKIN_SHARE * reach_m, SKIN_STEPS * fastest_m_s_ * seconds(step))),
      lists_due_(begin),
      lists_hold_until_(begin),
      next_change_(poses.size(), NEVER),
      speeds_(poses.size(), 0),
      still_since_(poses.size(), 0),
      steps_apart_(poses.size(), 0),
      in_contact_(poses.size(), false),
      next_contact_(poses.size(), NEVER),
      orders_(poses.size()),
      around_(poses.size()),
      shifts_(poses.size()) {
    trajectories_.reserve(poses.size());
    places_.reserve(poses.size());
    for (const Pose &pose : poses) {
        trajectories_.emplace_back(begin, pose);
        places_.push_back(pose.position);
    }
    listed_at_ = places_;
    lists_.rebuild(places_);
}

void Bodies::command(uint32_t robot, const MotorCommand &command) {
    const Cycles at = std::max(command.at, now_);
    orders_[robot].list.push_back({at, command.left, command.right});
    next_change_[robot] = std::min(next_change_[robot], at);
    // Otherwise its next contact was found for the fastest that it may go.
    if (trajectories_[robot].drive().at_rest())
        next_contact_[robot] = std::min(next_contact_[robot], begin_of_step(at, step_));
}

bool Bodies::refresh_lists() {
    if (now_ < lists_due_) return false;
    double square = 0;
    for (uint32_t robot = 0; robot < size(); robot++)
        square = std::max(square, (places_[robot] - listed_at_[robot]).squaredNorm());
    double drift_m = std::sqrt(square);
    const bool stale = 2 * drift_m > SKIN_USED * lists_.skin_m();
    if (stale) {
        listed_at_ = places_;
        lists_.rebuild(places_);
        list_rebuilds_++;
        drift_m = 0;
    }
    const double closing = 2 * fastest_m_s_;
    lists_hold_until_ = now_ + whole_steps((lists_.skin_m() - 2 * drift_m) / closing, step_);
    lists_due_ =
        now_ +
        std::max(step_, whole_steps((SKIN_USED * lists_.skin_m() - 2 * drift_m) / closing, step_));
    return stale;
}

void Bodies::step() {
    find_contacts();
    hand_over();
    solve_contacts();
    before_.clear();
    now_ += step_;
    place_all();
}

void Bodies::place_all() {
    constexpr size_t SOON = 4;
    choose(changing_, size(), [this](uint32_t robot) { return next_change_[robot] < now_; });
    for (size_t i = 0; i < changing_.size(); i++) {
        if (prefetches(size()) && i + SOON < changing_.size()) prefetch(changing_[i + SOON]);
        apply_commands(changing_[i], now_);
    }
    for (uint32_t robot = 0; robot < size(); robot++)
        places_[robot] = trajectories_[robot].position(now_);
}

void Bodies::apply_commands(uint32_t robot, Cycles until) {
    auto &[list, next] = orders_[robot];
    auto &trajectory = trajectories_[robot];
    while (next_change_[robot] < until) {
        const Cycles at = next_change_[robot];
        const bool commanded = next < list.size() && list[next].at <= at;
        const Drive drive = commanded
                                ? chassis_.set_duties(robot, at, list[next].left, list[next].right)
                                : chassis_.renew(robot);
        next += commanded;
        next_change_[robot] =
            std::min(next < list.size() ? list[next].at : NEVER, chassis_.next_renewal(robot));
        if (drive == trajectory.drive()) continue;
        if (!drive.stands())
            still_since_[robot] = NEVER;
        else if (!trajectory.drive().stands())
            still_since_[robot] = begin_of_step(at, step_) + step_;
        trajectory.change(at, drive);
        speeds_[robot] = drive.velocity.norm();
    }
    if (next < list.size()) return;
    list.clear();
    next = 0;
}

/// How a robot moves when this step begins.
const Trajectory &Bodies::trajectory_before(uint32_t robot) const {
    const uint32_t slot = shifts_[robot].before_slot;
    const bool changed = slot < before_.size() && before_[slot].robot == robot;
    return changed ? before_[slot].trajectory : trajectories_[robot];
}

/// Where a robot would go within this step; what changes its drive meanwhile takes effect.
void Bodies::find_free_shift(uint32_t robot, FreeShift &free) {
    const Trajectory &trajectory = trajectories_[robot];
    const Cycles end = now_ + step_;
    free.at = now_;
    free.heading = trajectory.heading(now_);
    if (next_change_[robot] < end) {
        free.before_slot = static_cast<uint32_t>(before_.size());
        before_.push_back({robot, trajectory});
        apply_commands(robot, end);
    }
    free.shift.by = trajectory.position(end) - places_[robot];
    free.shift.turn = wrapped(trajectory.heading(end) - free.heading);
}

void Bodies::look_around(uint32_t robot) {
    auto &[until, robots] = around_[robot];
    const auto list = lists_.of(robot);
    robots.resize(list.size(), boost::container::default_init);
    const Eigen::Vector2d here = position(robot);
    const double near_m = 2 * radius_m_ + std::max(NEAR * radius_m_, 3 * contact_gap_m_);
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

/// Brings those into the cache who may come upon something, some turns after the i-th.
void Bodies::prefetch_near_after(size_t i) const {
    constexpr size_t LATER = 4, LATEST = 6;
    if (!prefetches(size()) || i + LATEST >= near_something_.size()) return;
    const uint32_t latest = near_something_[i + LATEST];
    prefetch(latest);
    prefetch_line(&around_[latest]);
    prefetch_line(&shifts_[latest]);
    lists_.prefetch_place(latest);
    lists_.prefetch(near_something_[i + LATER]);
}

/// The robots that belong into the solver: whoever is about to touch a body or wall, and all whom
/// those may push in turn.
void Bodies::find_contacts() {
    contacts_.clear();
    pairs_.clear();
    choose(near_something_, size(),
           [this](uint32_t robot) { return next_contact_[robot] <= now_; });
    for (size_t i = 0; i < near_something_.size(); i++) {
        prefetch_near_after(i);
        if (may_touch(near_something_[i])) include(near_something_[i]);
    }
    // What is found up to here, and its pairs, is ascending.
    const size_t found = contacts_.size();
    for (size_t i = 0; i < found; i++) close_over(contacts_[i]);
    const size_t found_pairs = pairs_.size();
    for (size_t i = found; i < contacts_.size(); i++) close_over(contacts_[i]);
    sort_from(contacts_, found);
    sort_from(pairs_, found_pairs);
}

void Bodies::add_contact(uint32_t robot) {
    in_contact_[robot] = true;
    contacts_.push_back(robot);
    const double square = free_way(robot).squaredNorm();
    if (square > longest_shift_m_ * longest_shift_m_)
        longest_shift_m_ = std::max(longest_shift_m_, std::sqrt(square));
}

/// Whether a robot moves and comes upon something within this step. If not, says how long nothing
/// can.
bool Bodies::may_touch(uint32_t robot) {
    const Eigen::Vector2d here = position(robot);
    const Cycles change = next_change_[robot];
    if (trajectories_[robot].drive().at_rest() && change >= now_ + step_) {
        next_contact_[robot] = change == NEVER ? NEVER : begin_of_step(change, step_);
        return false;
    }
    const auto &others = around(robot);
    const double wall_gap = arena_.wall_gap(here) - radius_m_;
    next_contact_[robot] = now_ + step_;
    if (wall_gap <= contact_gap_m_ && meets_wall(robot)) return true;
    const double reach = contact_reach_m();
    double nearest = INFINITY;
    for (uint32_t other : others) {
        const double square = (position(other) - here).squaredNorm();
        if (square <= reach * reach && meets(robot, other)) return true;
        nearest = std::min(nearest, square);
    }
    const double free_m = std::min((std::sqrt(nearest) - reach) / 2, wall_gap - contact_gap_m_);
    const double free_s = std::min(free_m / fastest_m_s_, 1e6);
    next_contact_[robot] =
        std::clamp(now_ + whole_steps(free_s, step_), now_ + step_, around_[robot].until);
    return false;
}

/// No way within this step is longer.
double Bodies::longest_free_m(uint32_t robot) const {
    const bool steady = next_change_[robot] >= now_ + step_;
    return seconds(step_) * (steady ? speeds_[robot] : fastest_m_s_);
}

/// Whether two robots would touch, both going on as they do; they are nearer than the contact gap.
bool Bodies::meets(uint32_t robot, uint32_t other) {
    const Eigen::Vector2d apart = position(other) - position(robot);
    const double touch = 2 * radius_m_ + margin_m_, square = apart.squaredNorm();
    if (world_.holds(other)) {  // it may be pushed anywhere
        if (square <= touch * touch) return true;
        return std::sqrt(square) <= touch + free_way(robot).norm() + longest_shift_m_;
    }
    const double reach = touch + longest_free_m(robot) + longest_free_m(other);
    if (square > reach * reach) return false;
    const Eigen::Vector2d way = free_way(robot);
    const Eigen::Vector2d closing = free_way(other) - way;
    const double towards = -apart.dot(closing);
    if (towards <= 0) return false;
    const double part = std::min(towards / closing.squaredNorm(), 1.0);
    return (apart + part * closing).squaredNorm() <= touch * touch;
}

bool Bodies::meets_wall(uint32_t robot) {
    const Eigen::Vector2d there = position(robot) + free_way(robot);
    return arena_.wall_gap(there) <= radius_m_ + margin_m_;
}

/// Adds all whom one in contacts_ may come upon, as fast as any of them.
void Bodies::close_over(uint32_t robot) {
    const Eigen::Vector2d here = position(robot);
    const double reach = contact_reach_m();
    for (uint32_t other : around(robot)) {
        const bool included = in_contact_[other];
        if (included && other < robot) continue;  // it sees to the two
        const double square = (position(other) - here).squaredNorm();
        if (square > reach * reach) continue;
        const double distance = std::sqrt(square);
        if (!included) {
            const double closing = longest_shift_m_ + free_way(other).norm();
            if (distance - 2 * radius_m_ > closing + margin_m_) continue;
            include(other);
        }
        if (robot < other) pairs_.push_back({robot, other, distance});
    }
}

/// Takes robots into the solver, and those out that have been apart for some steps.
void Bodies::hand_over() {
    for (uint32_t robot : contacts_) {
        in_contact_[robot] = false;
        steps_apart_[robot] = 0;
        if (!world_.holds(robot)) world_.add(robot, trajectory_before(robot), now_);
    }
    size_t next = 0;
    world_.settle();
    for (uint32_t robot : world_.robots()) {
        if (next < contacts_.size() && contacts_[next] == robot)
            next++;
        else if (++steps_apart_[robot] >= STEPS_APART_TO_LEAVE)
            world_.remove(robot);
    }
    world_.settle();
}

void Bodies::solve_contacts() {
    const std::span<const uint32_t> held = world_.robots();
    pushed_.clear();
    if (held.empty()) {
        longest_shift_m_ = 0;
        return;
    }
    const Cycles end = now_ + step_;
    near_.resize(held.size());
    const std::span<Near> nears = near_;
    for (uint32_t i = 0; i < held.size(); i++) {
        const uint32_t robot = held[i];
        if (prefetches(size())) world_.prefetch(robot);
        Near &near = nears[i];
        FreeShift &free = free_shift(robot);
        near.free = free.shift;
        near.pose = {places_[robot], free.heading};
        free.near_slot = i;
        find_walls(near);
    }
    find_company();
    world_.step(near_, near_pairs_, seconds(step_));
    solver_steps_ += held.size();
    const std::span<Trajectory> trajectories = trajectories_;
    const std::span<Eigen::Vector2d> places = places_;
    double square = 0;
    for (size_t i = 0; i < held.size(); i++) {
        const uint32_t robot = held[i];
        const Near &near = nears[i];
        const auto &[by, turn] = near.moved;
        square = std::max({square, by.squaredNorm(), near.free.by.squaredNorm()});
        Trajectory &trajectory = trajectories[robot];
        const bool moved = by.x() != 0 || by.y() != 0;
        if (moved) still_since_[robot] = trajectory.drive().stands() ? end : NEVER;
        if (moved || turn != 0) pushed_.push_back(robot);
        const Pose pose = {near.pose.position + by, wrapped(near.pose.heading + turn)};
        trajectory.restart(end, pose);
        places[robot] = pose.position;
        record_overlap(arena_.wall_gap(pose.position) - radius_m_);
    }
    longest_shift_m_ = std::sqrt(square);
    const double touch = 2 * radius_m_;
    for (const auto &[one, other, distance_m] : pairs_) {
        const double apart = (places[other] - places[one]).squaredNorm();
        if (apart < touch * touch) record_overlap(std::sqrt(apart) - touch);
    }
}

/// Which robots in the solver may touch each other within this step.
void Bodies::find_company() {
    using Company = Near::Company;
    // Pushed by others, a robot goes no farther than the fastest of them.
    const double most_m = 2 * longest_shift_m_ + margin_m_;
    near_pairs_.clear();
    auto crowd = [&](Near &near) {
        if (near.company == Company::ROBOT) near_[near.other].company = Company::SEVERAL;
        near.company = Company::SEVERAL;
    };
    for (const auto &[one, other, distance_m] : pairs_) {
        const double gap_m = distance_m - 2 * radius_m_;
        if (gap_m > most_m) continue;
        const uint32_t first = shifts_[one].near_slot, second = shifts_[other].near_slot;
        near_pairs_.push_back({first, second});
        Near &a = near_[first], &b = near_[second];
        if (a.company != Company::NOTHING || b.company != Company::NOTHING) {
            crowd(a);
            crowd(b);
            continue;
        }
        a.company = b.company = Company::ROBOT;
        a.gap_m = b.gap_m = gap_m;
        a.other = second;
        b.other = first;
        a.towards = (b.pose.position - a.pose.position) / distance_m;
        b.towards = -a.towards;
    }
}

void Bodies::find_walls(Near &near) const {
    const double most_m = fastest_m_s_ * seconds(step_);
    near.company = Near::Company::NOTHING;
    near.at_wall = false;
    if (arena_.wall_gap(near.pose.position) - radius_m_ > most_m) return;
    arena_.for_each_wall(near.pose.position, [&](double distance, const Eigen::Vector2d &outward) {
        if (distance - radius_m_ > most_m) return;
        const bool first = near.company == Near::Company::NOTHING;
        near.company = first ? Near::Company::WALL : Near::Company::SEVERAL;
        near.at_wall = true;
        near.towards = outward;
        near.gap_m = distance - radius_m_;
    });
}

void Bodies::record_overlap(double gap_m) {
    if (gap_m < 0) overlaps_.add(-gap_m / (2 * radius_m_));
}

}  // namespace kilotwin
