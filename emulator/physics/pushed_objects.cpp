// Bodies: which objects take part in a step, and which robots may touch them.
#include <algorithm>

#include "physics/bodies.h"

namespace kilotwin {

namespace {

// An object slower than this, that nothing is near, stands.
constexpr double STANDS_M_S = 1e-7;

// Skin of the list of robots around an object: with a thicker one it is made more rarely.
constexpr double SKIN_RADII = 6;

}  // namespace

/// Finds the robots near each object: of those around it, by its outline.
void Bodies::find_near_objects() {
    std::fill(is_pushed_.begin(), is_pushed_.end(), false);
    std::fill(at_object_.begin(), at_object_.end(), false);
    for (uint32_t i = 0; i < objects_.size(); i++) {
        const Object &object = objects_[i];
        const Pose &pose = object_states_[i].pose;
        auto &robots = near_objects_[i];
        robots.clear();
        const double around_m = object.radius_m() + radius_m_ + contact_gap_m_;
        for (uint32_t robot : robots_around(i)) {
            if ((places_[robot] - pose.position).squaredNorm() > around_m * around_m) continue;
            if (object.gap(pose, places_[robot]) <= radius_m_ + contact_gap_m_)
                robots.push_back(robot);
        }
    }
}

/// The robots that may be near an object, ascending. The list holds until robots and object may
/// have come nearer by its skin: then all robots are looked at.
const std::vector<uint32_t> &Bodies::robots_around(uint32_t object) {
    Surroundings &around = surroundings_[object];
    const Eigen::Vector2d &here = object_states_[object].pose.position;
    const double skin_m = SKIN_RADII * radius_m_;
    if (around.made_at != NEVER) {
        // Twice: what overlaps is pushed apart besides.
        const double moved_m =
            2 * fastest_m_s_ * seconds(now_ - around.made_at) + (here - around.from).norm();
        if (moved_m < skin_m) return around.robots;
    }
    around.made_at = now_;
    around.from = here;
    around.robots.clear();
    const double reach_m = objects_[object].radius_m() + radius_m_ + contact_gap_m_ + skin_m;
    for (uint32_t robot = 0; robot < size(); robot++)
        if ((places_[robot] - here).squaredNorm() <= reach_m * reach_m)
            around.robots.push_back(robot);
    return around.robots;
}

/// Includes robots near objects that take part. Returns whether that added a robot or an object.
bool Bodies::include_objects() {
    bool added = false;
    for (uint32_t i = 0; i < objects_.size(); i++) {
        if (is_pushed_[i] || !is_pushed(i)) continue;
        is_pushed_[i] = added = true;
        for (uint32_t robot : near_objects_[i]) {
            at_object_[robot] = true;
            include(robot);
        }
    }
    return added;
}

/// Whether an object takes part in this step, as far as is known.
bool Bodies::is_pushed(uint32_t object) const {
    if (object_states_[object].moves()) return true;
    for (uint32_t robot : near_objects_[object])
        if (is_touching_[robot] || is_held_[robot] || !stays(robot)) return true;
    for (uint32_t other = 0; other < objects_.size(); other++)
        if (is_pushed_[other] && are_near(object, other)) return true;
    return false;
}

/// Whether two objects may touch within the step, by the circles around them.
bool Bodies::are_near(uint32_t object, uint32_t other) const {
    const double reach_m =
        objects_[object].radius_m() + objects_[other].radius_m() + contact_gap_m_;
    const Eigen::Vector2d apart =
        object_states_[other].pose.position - object_states_[object].pose.position;
    return apart.squaredNorm() <= reach_m * reach_m;
}

/// Lists the objects of this step. One that has come to a stop takes no part any more, unless
/// another that does is near, itself or by way of others.
void Bodies::take_pushed_objects() {
    for (uint32_t i = 0; i < objects_.size(); i++) is_stopped_[i] = has_stopped(i);
    for (bool found = true; found;) {
        found = false;
        for (uint32_t i = 0; i < objects_.size(); i++)
            if (is_stopped_[i] && is_near_pushed(i)) {
                is_stopped_[i] = false;
                found = true;
            }
    }
    pushed_objects_.clear();
    for (uint32_t i = 0; i < objects_.size(); i++) {
        ObjectState &state = object_states_[i];
        if (is_stopped_[i]) {
            state.velocity = {};
            is_pushed_[i] = false;
        }
        if (is_pushed_[i]) pushed_objects_.push_back({i, state});
    }
}

/// Whether an object takes part, though it stands and no robot is near.
bool Bodies::has_stopped(uint32_t object) const {
    const double speed_m_s = object_states_[object].most_m_s(objects_[object].radius_m());
    return is_pushed_[object] && near_objects_[object].empty() && speed_m_s < STANDS_M_S;
}

/// Whether another object is near that takes part, and is not known to have stopped.
bool Bodies::is_near_pushed(uint32_t object) const {
    for (uint32_t other = 0; other < objects_.size(); other++)
        if (other != object && is_pushed_[other] && !is_stopped_[other] && are_near(object, other))
            return true;
    return false;
}

}  // namespace kilotwin
