#include "physics/bodies.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/trigonometry.h"

namespace kilotwin {

namespace {

// The skin of the neighbour lists: a share of their reach, but at least some steps of driving.
constexpr double SKIN_SHARE = 0.6;
constexpr double SKIN_STEPS = 10;
// Lists are renewed when so much of the skin is used up: the rest is left for running ahead.
constexpr double SKIN_USED = 0.6;
constexpr double CONTACT_MARGIN = 0.03;      // of a radius
constexpr double CANDIDATE_GAP = 2;          // of a radius: gap up to which robots are candidates
constexpr uint8_t STEPS_APART_TO_LEAVE = 2;  // then a robot is free again
// Limit of the speed of a pushed robot, relative to the fastest drive.
constexpr double PUSHED_SPEED = 1.1;

std::vector<Object> objects_of(const std::vector<PlacedObject> &placed) {
    std::vector<Object> objects;
    objects.reserve(placed.size());
    for (const auto &[object, pose] : placed) objects.push_back(object);
    return objects;
}

}  // namespace

Bodies::Bodies(const Arena &arena, const Profile &profile, const Chance &chance, const Slots &slots,
               Team &team, Cycles step, Cycles begin, const std::vector<Pose> &poses,
               double reach_m, const std::vector<PlacedObject> &objects)
    : arena_(arena),
      team_(team),
      radius_m_(profile.radius_m),
      margin_m_(CONTACT_MARGIN * profile.radius_m),
      step_(step),
      now_(begin),
      chassis_(profile, chance, slots),
      fastest_m_s_(PUSHED_SPEED * chassis_.fastest_m_s()),
      contact_gap_m_(2 * fastest_m_s_ * seconds(step) + margin_m_),
      unlisted_for_(whole_steps(
          (std::max(reach_m, contact_reach_m()) - contact_reach_m()) / (2 * fastest_m_s_), step)),
      objects_(objects_of(objects)),
      contacts_(arena, profile, chassis_.fastest_m_s(), fastest_m_s_, poses.size(), objects_),
      lists_(std::max(reach_m, contact_reach_m()),
             std::max(SKIN_SHARE * reach_m, SKIN_STEPS * fastest_m_s_ * seconds(step))),
      lists_due_(begin),
      lists_hold_until_(begin),
      next_change_(poses.size(), NEVER),
      speeds_(poses.size(), 0),
      still_since_(poses.size(), 0),
      steps_apart_(poses.size(), 0),
      is_touching_(poses.size(), false),
      next_contact_(poses.size(), NEVER),
      commands_(poses.size()),
      candidates_(poses.size()),
      shares_(team.size()) {
    trajectories_.reserve(poses.size());
    places_.reserve(poses.size());
    for (const Pose &pose : poses) {
        trajectories_.emplace_back(begin, pose);
        places_.push_back(pose.position);
    }
    next_places_ = listed_at_ = places_;
    lists_.rebuild(places_);
    for (const auto &placed : objects) object_states_.push_back({placed.pose, {}});
    is_pushed_.resize(objects.size());
    surroundings_.resize(objects.size());
    is_stopped_.resize(objects.size());
    near_objects_.resize(objects.size());
    if (!objects.empty()) at_object_.resize(poses.size());
}

void Bodies::command(uint32_t robot, const MotorCommand &command) {
    const Cycles at = std::max(command.at, now_);
    commands_[robot].list.push_back({at, command.left, command.right});
    next_change_[robot] = std::min(next_change_[robot], at);
    // A robot that moves had its next contact found for the fastest speed; one at rest did not.
    if (trajectories_[robot].drive().at_rest())
        next_contact_[robot] = std::min(next_contact_[robot], begin_of_step(at, step_));
}

// Its duties are ordered again, so that its drive is found anew.
void Bodies::scale_motors(uint32_t robot, double left, double right) {
    chassis_.scale_motors(robot, left, right);
    const auto [left_duty, right_duty] = chassis_.duties(robot);
    command(robot, {now_, left_duty, right_duty});
}

// Work that was done early for their sake stays done.
void Bodies::take_back_commands(uint32_t robot, Cycles from) {
    auto &[list, next] = commands_[robot];
    while (next < list.size() && list.back().at >= from) list.pop_back();
    next_change_[robot] =
        std::min(next < list.size() ? list[next].at : NEVER, chassis_.next_renewal(robot));
}

bool Bodies::has_room(uint32_t robot, const Eigen::Vector2d &point) const {
    if (!arena_.has_room(point, radius_m_)) return false;
    for (uint32_t i = 0; i < objects_.size(); i++)
        if (objects_[i].gap(object_states_[i].pose, point) < radius_m_) return false;
    const double touch = 2 * radius_m_;
    for (uint32_t other = 0; other < size(); other++)
        if (other != robot && (places_[other] - point).squaredNorm() < touch * touch) return false;
    return true;
}

// Whatever was found out from where robots were is found anew: for all of them, since it may now be
// near any.
void Bodies::place(uint32_t robot, const Pose &pose) {
    trajectories_[robot].restart(now_, pose);
    places_[robot] = pose.position;
    if (trajectories_[robot].drive().stands()) still_since_[robot] = now_;
    contacts_.forget(robot);
    std::fill(next_contact_.begin(), next_contact_.end(), now_);
    for (Candidates &candidates : candidates_) candidates.until = now_;
    for (Surroundings &around : surroundings_) around.made_at = NEVER;
    lists_stale_ = true;
    lists_due_ = now_;
}

bool Bodies::refresh_lists() {
    if (now_ < lists_due_) return false;
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        double square = 0;
        for (size_t robot = begin; robot < end; robot++)
            square = std::max(square, (places_[robot] - listed_at_[robot]).squaredNorm());
        shares_[share].drift_square = square;
    });
    double square = 0;
    for (const Share &share : shares_) square = std::max(square, share.drift_square);
    double drift_m = std::sqrt(square);
    const bool stale = lists_stale_ || 2 * drift_m > SKIN_USED * lists_.skin_m();
    if (stale) {
        lists_stale_ = false;
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
    go_freely();
    find_contacts();
    update_contacts();
    step_contacts();
    before_.clear();
    now_ += step_;
    places_.swap(next_places_);
}

/// Commands within this step take effect, and all robots go on up to its end.
void Bodies::go_freely() {
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        choose(shares_[share].changing, begin, end,
               [this](uint32_t robot) { return next_change_[robot] < now_ + step_; });
    });
    size_t changing = 0;
    for (const Share &share : shares_) changing += share.changing.size();
    before_.resize(changing);
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        size_t slot = 0;
        for (uint32_t other = 0; other < share; other++) slot += shares_[other].changing.size();
        change_drives(shares_[share], slot);
        for (size_t robot = begin; robot < end; robot++)
            next_places_[robot] = trajectories_[robot].position(now_ + step_);
    });
}

/// Commands of the robots of a share take effect. Their trajectories when the step began are kept in
/// before_ from `slot` on.
void Bodies::change_drives(const Share &share, size_t slot) {
    constexpr size_t SOON = 4;
    const auto &changing = share.changing;
    for (size_t i = 0; i < changing.size(); i++, slot++) {
        if (prefetches(size()) && i + SOON < changing.size()) prefetch_motors(changing[i + SOON]);
        const uint32_t robot = changing[i];
        before_[slot] = {robot, trajectories_[robot]};
        candidates_[robot].before_slot = static_cast<uint32_t>(slot);
        apply_commands(robot, now_ + step_);
    }
}

void Bodies::apply_commands(uint32_t robot, Cycles until) {
    auto &[list, next] = commands_[robot];
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

/// Whether commands of this step took effect already: its trajectory is that of the step's end.
bool Bodies::has_changed(uint32_t robot) const {
    const uint32_t slot = candidates_[robot].before_slot;
    return slot < before_.size() && before_[slot].robot == robot;
}

/// The trajectory of a robot when this step began.
const Trajectory &Bodies::trajectory_before(uint32_t robot) const {
    const bool changed = has_changed(robot);
    return changed ? before_[candidates_[robot].before_slot].trajectory : trajectories_[robot];
}

void Bodies::find_candidates(uint32_t robot) {
    auto &[until, robots, before_slot, body_slot] = candidates_[robot];
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
void Bodies::prefetch_ahead(const Share &share, size_t i) const {
    constexpr size_t LATER = 4, LATEST = 6;
    if (!prefetches(size()) || i + LATEST >= share.near_contact.size()) return;
    const uint32_t latest = share.near_contact[i + LATEST];
    prefetch_line(&trajectories_[latest]);
    prefetch_line(&candidates_[latest]);
    lists_.prefetch_place(latest);
    lists_.prefetch(share.near_contact[i + LATER]);
}

/// Finds the robots that may touch a body or a wall within this step, and all that those may push
/// in turn.
void Bodies::find_contacts() {
    touching_.clear();
    pairs_.clear();
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        find_touching(shares_[share], begin, end);
    });
    for (const Share &share : shares_)
        for (const uint32_t robot : share.touching) include(robot);
    // Robots found up to here are ascending, and so are their pairs.
    size_t next = 0;
    auto add_all_touched = [&] {
        for (; next < touching_.size(); next++) add_touched(touching_[next]);  // which grows
    };
    add_all_touched();
    if (!objects_.empty()) {
        find_near_objects();
        while (include_objects()) add_all_touched();
    }
    sort_tail(touching_);
    sort_tail(pairs_);
}

/// Looks at robots one by one. What is found of one does not depend on what is found of others.
void Bodies::find_touching(Share &share, size_t begin, size_t end) {
    choose(share.near_contact, begin, end,
           [this](uint32_t robot) { return next_contact_[robot] <= now_; });
    share.touching.clear();
    for (size_t i = 0; i < share.near_contact.size(); i++) {
        prefetch_ahead(share, i);
        if (may_touch(share.near_contact[i])) share.touching.push_back(share.near_contact[i]);
    }
}

void Bodies::add_touching(uint32_t robot) {
    is_touching_[robot] = true;
    touching_.push_back(robot);
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
    if (contacts_.holds(other)) {  // it may be pushed anywhere
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

/// Adds all that a robot of touching_ may touch, moving as fast as the fastest of them.
void Bodies::add_touched(uint32_t robot) {
    const Eigen::Vector2d here = position(robot);
    const double reach = contact_reach_m();
    for (uint32_t other : candidates(robot)) {
        const bool included = is_touching_[other];
        if (included && other < robot) continue;  // the other adds the pair
        const double square = (position(other) - here).squaredNorm();
        if (square > reach * reach) continue;
        const double distance = std::sqrt(square);
        if (!included) {
            const double closing = longest_shift_m_ + free_path(other).norm();
            if (distance - 2 * radius_m_ > closing + margin_m_) continue;
            include(other);
        }
        if (robot < other) pairs_.push_back({robot, other, distance});
    }
}

/// Adds robots to contacts_, and removes those that have touched nothing for some steps.
void Bodies::update_contacts() {
    for (uint32_t robot : touching_) {
        is_touching_[robot] = false;
        steps_apart_[robot] = 0;
        if (!contacts_.holds(robot)) contacts_.add(robot, trajectory_before(robot), now_);
    }
    size_t next = 0;
    contacts_.update();
    for (uint32_t robot : contacts_.robots()) {
        if (next < touching_.size() && touching_[next] == robot)
            next++;
        else if (++steps_apart_[robot] >= STEPS_APART_TO_LEAVE)
            contacts_.remove(robot);
    }
    contacts_.update();
}

void Bodies::step_contacts() {
    const std::span<const uint32_t> held = contacts_.robots();
    pushed_.clear();
    take_pushed_objects();
    if (held.empty() && pushed_objects_.empty()) {
        longest_shift_m_ = 0;
        return;
    }
    contact_bodies_.resize(held.size());
    team_.share(held.size(), [this](uint32_t, size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) fill_body(static_cast<uint32_t>(i));
    });
    find_body_pairs();
    contacts_.step(contact_bodies_, body_pairs_, pushed_objects_, seconds(step_));
    solver_steps_ += held.size();
    team_.share(held.size(), [this](uint32_t, size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) take_moved(i, now_ + step_);
    });
    double square = 0;
    for (size_t i = 0; i < held.size(); i++) {
        const ContactBody &body = contact_bodies_[i];
        const auto &[by, turn] = body.moved;
        square = std::max({square, by.squaredNorm(), body.free.by.squaredNorm()});
        if (by.x() != 0 || by.y() != 0 || turn != 0) pushed_.push_back(held[i]);
        record_overlap(body.gap_m);
    }
    longest_shift_m_ = std::sqrt(square);
    for (const auto &[object, state] : pushed_objects_)
        longest_shift_m_ = std::max(longest_shift_m_,
                                    seconds(step_) * state.most_m_s(objects_[object].radius_m()));
    const double touch = 2 * radius_m_;
    for (const auto &[one, other, distance_m] : pairs_) {
        const double apart = (next_places_[other] - next_places_[one]).squaredNorm();
        if (apart < touch * touch) record_overlap(std::sqrt(apart) - touch);
    }
}

/// The i-th body, as its robot would go if nothing touched it.
void Bodies::fill_body(uint32_t i) {
    const uint32_t robot = contacts_.robots()[i];
    if (prefetches(size())) contacts_.prefetch(robot);
    const double heading = trajectory_before(robot).heading(now_);
    const double then = trajectories_[robot].heading(now_ + step_);
    ContactBody &body = contact_bodies_[i];
    body.free = {free_path(robot), wrapped(then - heading)};
    body.pose = {places_[robot], heading};
    candidates_[robot].body_slot = i;
    find_wall_contacts(body);
    if (!at_object_.empty() && at_object_[robot]) body.kind = ContactBody::Kind::ISLAND;
}

/// Restarts the trajectory of the i-th robot held by contacts_ where the step ended. Its body's gap
/// is that to the walls from there on.
void Bodies::take_moved(size_t i, Cycles end) {
    const uint32_t robot = contacts_.robots()[i];
    ContactBody &body = contact_bodies_[i];
    const auto &[by, turn] = body.moved;
    Trajectory &trajectory = trajectories_[robot];
    const bool moved = by.x() != 0 || by.y() != 0;
    if (moved) still_since_[robot] = trajectory.drive().stands() ? end : NEVER;
    const Pose pose = {body.pose.position + by, wrapped(body.pose.heading + turn)};
    trajectory.restart(end, pose);
    next_places_[robot] = pose.position;
    body.gap_m = arena_.wall_gap(pose.position) - radius_m_;
}

/// Finds which robots held by contacts_ may touch each other within this step.
void Bodies::find_body_pairs() {
    // A pushed robot moves no farther than the fastest of those that push it.
    const double most_m = 2 * longest_shift_m_ + margin_m_;
    body_pairs_.clear();
    for (const auto &[one, other, distance_m] : pairs_)
        if (distance_m - 2 * radius_m_ <= most_m)
            body_pairs_.push_back(
                {candidates_[one].body_slot, candidates_[other].body_slot, distance_m});
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

void Bodies::record_overlap(double gap_m) {
    if (gap_m < 0) overlaps_.add(-gap_m / (2 * radius_m_));
}

}  // namespace kilotwin
