#include "infrared/lanes.h"

#include <limits>
#include <stdexcept>

namespace kilotwin {

Lanes::Lanes(Team &team, size_t robots)
    : team_(team),
      joint_(team.size() > 1 ? team.size() : 0),
      borders_(joint_) {
    if (joint_ > std::numeric_limits<decltype(lane_)::value_type>::max())
        throw std::length_error("too many members of a team for Lanes::lane_");
    if (joint_ == 0) return;
    is_seen_.resize(robots);
    for (size_t robot = 0; robot < robots; robot++)
        lane_.push_back(static_cast<uint8_t>(team.share_of(robot, robots)));
}

// Lists are ascending, and shares are blocks.
void Lanes::lists_changed(const Neighbours &lists) {
    if (joint_ == 0) return;
    team_.share(lane_.size(), [&](uint32_t share, size_t begin, size_t end) {
        auto &robots = borders_[share].robots;
        robots.clear();
        for (auto robot = static_cast<uint32_t>(begin); robot < end; robot++) {
            const Neighbours::List list = lists.of(robot);
            if (list.size() > 0 && (*list.begin() < begin || *(list.end() - 1) >= end))
                robots.push_back(robot);
        }
    });
    size_t at_borders = 0;
    for (const Border &border : borders_) at_borders += border.robots.size();
    may_be_cut_ = 2 * at_borders < lane_.size();
}

/// Each robot is in the lane of its share.
void Lanes::separate() {
    for (const uint32_t robot : joined_)
        lane_[robot] = static_cast<uint8_t>(team_.share_of(robot, lane_.size()));
    for (const uint32_t robot : seen_) is_seen_[robot] = false;
    joined_.clear();
    seen_.clear();
}

}  // namespace kilotwin
