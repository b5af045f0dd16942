#include "physics/bodies.h"

#include <algorithm>
#include <cmath>

#include "base/trigonometry.h"

namespace kilotwin {

namespace {

// The skin of the neighbour lists: a share of their reach, but at least some steps of driving.
constexpr double SKIN_SHARE = 0.6;
constexpr double SKIN_STEPS = 10;
// Lists are renewed when so much of the skin is used up: the rest is left for running ahead.
constexpr double SKIN_USED = 0.6;
constexpr double CONTACT_MARGIN = 0.03;  // of a radius
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
      contacts_(arena, profile, team, chassis_.fastest_m_s(), fastest_m_s_, poses.size(), objects_),
      lists_(std::max(reach_m, contact_reach_m()),
             std::max(SKIN_SHARE * reach_m, SKIN_STEPS * fastest_m_s_ * seconds(step)), team),
      lists_due_(begin),
      lists_hold_until_(begin),
      next_change_(poses.size(), NEVER),
      speeds_(poses.size(), 0),
      still_since_(poses.size(), 0),
      is_held_(poses.size(), false),
      steps_apart_(poses.size(), 0),
      is_touching_(poses.size(), false),
      next_contact_(poses.size(), NEVER),
      commands_(poses.size()),
      candidates_(poses.size()),
      shares_(team.size()) {
    crowd_.shares.resize(team.size());
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
    if (is_held_[robot]) contacts_.forget(robot);
    is_held_[robot] = false;
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
        team_.share(size(), [this](uint32_t /*share*/, size_t begin, size_t end) {
            std::copy(places_.data() + begin, places_.data() + end, listed_at_.data() + begin);
        });
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
    changing_ = 0;
    now_ += step_;
    places_.swap(next_places_);
}

/// Commands within this step take effect, and all robots go on up to its end.
void Bodies::go_freely() {
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        choose(shares_[share].changing, begin, end,
               [this](uint32_t robot) { return next_change_[robot] < now_ + step_; });
    });
    for (const Share &share : shares_) changing_ += share.changing.size();
    if (before_.size() < changing_) {  // not twice as much: all may begin to move at once
        std::vector<Before>().swap(before_);
        before_.resize(changing_);
    }
    team_.share(size(), [this](uint32_t share, size_t begin, size_t end) {
        size_t number = 0;
        for (uint32_t other = 0; other < share; other++) number += shares_[other].changing.size();
        change_drives(shares_[share], number);
        for (size_t robot = begin; robot < end; robot++)
            next_places_[robot] = trajectories_[robot].position(now_ + step_);
    });
}

/// Commands of the robots of a share take effect. How these went when the step began is kept in
/// before_ from `number` on.
void Bodies::change_drives(const Share &share, size_t number) {
    constexpr size_t SOON = 4;
    const auto &changing = share.changing;
    for (size_t i = 0; i < changing.size(); i++, number++) {
        if (prefetches(size()) && i + SOON < changing.size()) prefetch_motors(changing[i + SOON]);
        const uint32_t robot = changing[i];
        before_[number] = {robot,
                           {trajectories_[robot].heading(now_), trajectories_[robot].drive()}};
        candidates_[robot].before_number = static_cast<uint32_t>(number);
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
    const uint32_t number = candidates_[robot].before_number;
    return number < changing_ && before_[number].robot == robot;
}

Bodies::Going Bodies::going(uint32_t robot) const {
    if (has_changed(robot)) return before_[candidates_[robot].before_number].going;
    return {trajectories_[robot].heading(now_), trajectories_[robot].drive()};
}

Overlaps Bodies::overlaps() const {
    Overlaps all;
    for (const Share &share : shares_) all.add(share.overlaps);
    return all;
}

}  // namespace kilotwin
