/// Lanes: which stations' events on the Kilobots' channel are taken one after the other, and which
/// side by side.
///
/// Within a world step an event at a station touches that station, those in its neighbour list and
/// the frames audible at these. So two stations that are active (that have, or may come to have,
/// events in this step) depend on one another only if both reach a common one, or through a chain
/// of such pairs. Each share of a team (base/team.h) has a lane. Active robots that reach one of
/// another share, and all that depend on them, are in the joint lane, which has its turn when the
/// others are done. Each lane takes its events in order of time: what comes out is what one lane
/// would give.
///
/// Where most robots have neighbours of other shares, and where cut() is not called, the joint lane
/// has all stations.
#ifndef KILOTWIN_INFRARED_LANES_H
#define KILOTWIN_INFRARED_LANES_H

#include <cstdint>
#include <vector>

#include "base/team.h"
#include "physics/neighbours.h"

namespace kilotwin {

/// One per Kilobot channel.
class Lanes {
  public:
    /// For the shares of `team`, which must live on. A team of one member has the joint lane alone.
    Lanes(Team &team, size_t robots);

    /// How many lanes there are. Those of shares have the shares' numbers; the joint one is the
    /// last.
    uint32_t count() const { return joint_ + 1; }
    uint32_t joint() const { return joint_; }

    /// Whether there are robots in other lanes than the joint one in this step.
    bool are_cut() const { return is_cut_; }

    /// The lane of a station in this step. Time O(1).
    uint32_t of(uint32_t station) const { return is_cut_ ? lane_[station] : joint_; }

    /// Robots in the joint lane, while lanes are cut.
    const std::vector<uint32_t> &joined() const { return joined_; }

    /// Lists of neighbours were made anew. Time O(robots), shared.
    void lists_changed(const Neighbours &lists);

    /// All stations are in the joint lane.
    void join() { is_cut_ = false; }

    /// Finds the lanes of a step; true if there are others than the joint one. All stations must be
    /// robots, and each `is_active(robot)` that may have an event in the step. Time O(robots at the
    /// borders of shares, and neighbours of those that depend on them).
    template <typename IsActive> bool cut(const Neighbours &lists, IsActive is_active) {
        separate();
        if (!may_be_cut_) return is_cut_ = false;
        auto look_at = [&](uint32_t robot) {
            if (lane_[robot] != joint_ && is_active(robot)) join(robot);
        };
        for (const Border &border : borders_)
            for (const uint32_t robot : border.robots) look_at(robot);
        // The list grows meanwhile.
        for (size_t i = 0; i < joined_.size(); i++) {
            const uint32_t sender = joined_[i];
            for (const uint32_t reached : lists.of(sender)) {
                if (is_seen_[reached]) continue;
                is_seen_[reached] = true;
                seen_.push_back(reached);
                look_at(reached);
                for (const uint32_t other : lists.of(reached)) look_at(other);
            }
        }
        return is_cut_ = true;
    }

  private:
    /// Robots of a share with neighbours of another one.
    struct alignas(64) Border {
        std::vector<uint32_t> robots;
    };

    void separate();
    void join(uint32_t robot) {
        lane_[robot] = static_cast<uint8_t>(joint_);
        joined_.push_back(robot);
    }

    Team &team_;
    uint32_t joint_;
    bool is_cut_ = false, may_be_cut_ = false;
    std::vector<uint8_t> lane_;     ///< by robot, where there are several
    std::vector<uint8_t> is_seen_;  ///< by robot: it is in seen_
    std::vector<Border> borders_;   ///< by share
    std::vector<uint32_t> joined_;  ///< of the last step that was cut
    std::vector<uint32_t> seen_;    ///< those that they reach
};

}  // namespace kilotwin

#endif
