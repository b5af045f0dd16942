#include "engine/bodies.h"

#include <algorithm>
#include <cmath>

#include "engine/trigonometry.h"

namespace kilotwin {

namespace {

constexpr double SKIN_SHARE = 0.4;  // of the lists' reach, but at least so many steps of driving:
constexpr double SKIN_STEPS = 10;
constexpr double SKIN_USED =
    0.6;  // of the skin, before new lists are made: the rest is for running ahead
constexpr double CONTACT_MARGIN = 0.05;  // of a radius
constexpr uint8_t STEPS_APART_TO_LEAVE = 4;
constexpr uint32_t STEPS_TOUCHING_TO_CARE = 4;
constexpr double TOUCHING = 0.001;  // of a diameter
constexpr double PUSHED_SPEED = 2;

}  // namespace

Bodies::Bodies(const Arena &arena, const Profile &profile, const Chance &chance, Cycles step,
               Cycles begin, const std::vector<Pose> &poses, double reach_m)
    : arena_(arena),
      radius_m_(profile.radius_m),
      step_(step),
      now_(begin),
      chassis_(profile, chance, poses.size()),
      fastest_m_s_(PUSHED_SPEED * chassis_.fastest_m_s()),
      contact_gap_m_(2 * fastest_m_s_ * seconds(step) + CONTACT_MARGIN * profile.radius_m),
      world_(arena, profile, chassis_.fastest_m_s(), poses.size()),
      lists_(std::max(reach_m, 2 * profile.radius_m + contact_gap_m_),
             std::max(SKIN_SHARE * reach_m, SKIN_STEPS * fastest_m_s_ * seconds(step))),
      lists_due_(begin),
      lists_hold_until_(begin),
      placed_at_(poses.size(), begin),
      next_change_(poses.size(), NEVER),
      still_since_(poses.size(), 0),
      next_contact_(poses.size(), NEVER),
      orders_(poses.size()),
      steps_apart_(poses.size(), 0),
      in_contact_(poses.size(), false) {
    for (const auto &pose : poses) {
        trajectories_.emplace_back(begin, pose);
        positions_.push_back(pose.position);
    }
    lists_.rebuild(positions_);
    listed_at_ = positions_;
}

void Bodies::command(uint32_t robot, const MotorCommand &command) {
    const Cycles at = std::max(command.at, now_);
    orders_[robot].list.push_back({at, command.left, command.right});
    next_change_[robot] = std::min(next_change_[robot], at);
    next_contact_[robot] = std::min(next_contact_[robot], now_);
}

/// World steps that lie wholly within `for_s` seconds.
Cycles Bodies::whole_steps(double for_s) const {
    return for_s <= 0 ? 0 : static_cast<Cycles>(for_s / seconds(step_)) * step_;
}

bool Bodies::refresh_lists() {
    if (now_ < lists_due_) return false;
    double drift_m = 0;
    for (uint32_t robot = 0; robot < size(); robot++)
        drift_m = std::max(drift_m, (position(robot) - listed_at_[robot]).norm());
    const bool stale = 2 * drift_m > SKIN_USED * lists_.skin_m();
    if (stale) {
        lists_.rebuild(positions_);
        listed_at_ = positions_;
        list_rebuilds_++;
        drift_m = 0;
    }
    const double closing = 2 * fastest_m_s_;
    lists_hold_until_ = now_ + whole_steps((lists_.skin_m() - 2 * drift_m) / closing);
    lists_due_ =
        now_ + std::max(step_, whole_steps((SKIN_USED * lists_.skin_m() - 2 * drift_m) / closing));
    return stale;
}

void Bodies::step() {
    find_contacts();
    hand_over();
    solve_contacts();
    now_ += step_;
}

void Bodies::catch_up() {
    for (uint32_t robot = 0; robot < size(); robot++) apply_commands(robot, now_);
}

void Bodies::place(uint32_t robot) {
    apply_commands(robot, now_);
    positions_[robot] = trajectories_[robot].position(now_);
    placed_at_[robot] = now_;
}

Eigen::Vector2d Bodies::ahead(uint32_t robot) {
    apply_commands(robot, now_);
    return trajectories_[robot].ahead(now_);
}

bool Bodies::rests(uint32_t robot) const {
    return next_change_[robot] == NEVER && trajectories_[robot].drive().at_rest() &&
           !world_.holds(robot);
}

Cycles Bodies::still_since(uint32_t robot) {
    apply_commands(robot, now_);
    return still_since_[robot];
}

/// Lets motor commands before `until`, and what changes by itself, take effect at their times.
void Bodies::apply_commands(uint32_t robot, Cycles until) {
    if (next_change_[robot] >= until) return;
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
            still_since_[robot] = at - (at - now_) % step_ + step_;  // the end of that step
        trajectory.change(at, drive);
    }
    if (next < list.size()) return;
    list.clear();
    next = 0;
}

bool Bodies::moves_in_step(uint32_t robot) const {
    return !trajectories_[robot].drive().at_rest() || next_change_[robot] < now_ + step_;
}

/// The robots that belong into the solver: whoever moves near a body or wall, and all who stand
/// near those in turn.
void Bodies::find_contacts() {
    const double reach = 2 * radius_m_ + contact_gap_m_;
    contacts_.clear();
    auto include = [&](uint32_t robot) {
        if (in_contact_[robot]) return;
        in_contact_[robot] = true;
        contacts_.push_back(robot);
    };
    for (uint32_t robot = 0; robot < size(); robot++)
        if (next_contact_[robot] <= now_ && may_touch(robot)) include(robot);
    for (size_t i = 0; i < contacts_.size(); i++) {
        const Eigen::Vector2d here = position(contacts_[i]);
        for (uint32_t other : lists_.of(contacts_[i]))
            if ((position(other) - here).squaredNorm() <= reach * reach) include(other);
    }
    std::sort(contacts_.begin(), contacts_.end());
}

/// Whether a robot moves and is near something; if not, for how long that holds.
bool Bodies::may_touch(uint32_t robot) {
    const Eigen::Vector2d here = position(robot);
    if (!moves_in_step(robot)) {
        const Cycles change = next_change_[robot];
        next_contact_[robot] = change == NEVER ? NEVER : change - (change - now_) % step_;
        return false;
    }
    const double own = chassis_.fastest_m_s(), closing = own + fastest_m_s_;
    double free_s = seconds(std::max(lists_hold_until_, now_) - now_);
    for (uint32_t other : lists_.of(robot)) {
        const double gap = (position(other) - here).norm() - 2 * radius_m_ - contact_gap_m_;
        free_s = std::min(free_s, gap / closing);
    }
    arena_.for_each_wall(here, [&](double distance, const Eigen::Vector2d &) {
        free_s = std::min(free_s, (distance - radius_m_ - contact_gap_m_) / own);
    });
    next_contact_[robot] =
        now_ + (world_.holds(robot) ? step_ : std::max(whole_steps(free_s), step_));
    return free_s <= 0;
}

/// Takes robots into the solver, and those out that have been apart for some steps.
void Bodies::hand_over() {
    for (uint32_t robot : contacts_) {
        in_contact_[robot] = false;
        steps_apart_[robot] = 0;
        if (!world_.holds(robot)) world_.add(robot, trajectories_[robot], now_);
    }
    leaving_.clear();
    size_t next = 0;
    for (uint32_t robot : world_.robots()) {
        if (next < contacts_.size() && contacts_[next] == robot)
            next++;
        else if (++steps_apart_[robot] >= STEPS_APART_TO_LEAVE)
            leaving_.push_back(robot);
    }
    for (uint32_t robot : leaving_) world_.remove(robot);
}

void Bodies::solve_contacts() {
    const auto &held = world_.robots();
    pushed_.clear();
    if (held.empty()) {
        touching_steps_ = 0;
        return;
    }
    const Cycles end = now_ + step_;
    const double step_s = seconds(step_);
    poses_before_.clear();
    free_shifts_.clear();
    for (uint32_t robot : held) {
        poses_before_.push_back(trajectories_[robot].pose(now_));
        apply_commands(robot, end);
        const Pose alone = trajectories_[robot].pose(end), &before = poses_before_.back();
        free_shifts_.push_back(
            {alone.position - before.position, wrapped(alone.heading - before.heading)});
    }
    world_.step(free_shifts_, step_s, touching_steps_ >= STEPS_TOUCHING_TO_CARE);
    solver_steps_ += held.size();
    for (size_t i = 0; i < held.size(); i++) {
        const uint32_t robot = held[i];
        Pose pose = poses_before_[i];
        const Shift shift = world_.moved(robot);
        const bool moved = shift.by != Eigen::Vector2d::Zero();
        if (moved) still_since_[robot] = trajectories_[robot].drive().stands() ? end : NEVER;
        if (moved || shift.turn != 0) pushed_.push_back(robot);
        pose.position += shift.by;
        pose.heading = wrapped(pose.heading + shift.turn);
        trajectories_[robot].restart(end, pose);
        positions_[robot] = pose.position;
        placed_at_[robot] = end;
    }
    record_overlaps();
}

void Bodies::record_overlaps() {
    const double diameter = 2 * radius_m_;
    bool touching = false;
    auto add = [&](double gap) {
        if (gap < TOUCHING * diameter) touching = true;
        if (gap < 0) overlaps_.add(-gap / diameter);
    };
    for (uint32_t robot : world_.robots()) {
        for (uint32_t other : lists_.of(robot))
            if (other > robot && world_.holds(other))
                add((positions_[other] - positions_[robot]).norm() - diameter);
        add(arena_.wall_gap(positions_[robot]) - radius_m_);
    }
    touching_steps_ = touching ? touching_steps_ + 1 : 0;
}

}  // namespace kilotwin
