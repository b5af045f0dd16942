/// Neighbour lists: for each robot the robots around it, within a reach and a skin, as in a Verlet
/// list. They hold until two robots together have moved by more than the skin; Bodies keeps track
/// of that. Both contacts and channels look for robots in these lists only.
#ifndef KILOTWIN_PHYSICS_NEIGHBOURS_H
#define KILOTWIN_PHYSICS_NEIGHBOURS_H

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "base/prefetch.h"
#include "base/team.h"

namespace kilotwin {

/// Memory: 5 bytes a robot and 8 a pair of robots in reach, of which there may be 2^31; while lists
/// are made some 30 bytes a robot and 24 a pair more.
class Neighbours {
  public:
    /// A list has all robots within `reach_m` + `skin_m` (m, above 0) at the time of rebuild().
    /// `team` must outlive this.
    Neighbours(double reach_m, double skin_m, Team &team)
        : reach_m_(reach_m),
          skin_m_(skin_m),
          team_(team) {}

    /// Makes all lists from the robots' positions, m.
    /// O(robots + pairs): robots are sorted into square cells as wide as the lists reach; each
    /// member of the team has a block of cells.
    void rebuild(std::span<const Eigen::Vector2d> positions);

    /// A view of one list. Valid until the next rebuild().
    struct List {
        const uint32_t *first, *last;
        const uint32_t *begin() const { return first; }
        const uint32_t *end() const { return last; }
        size_t size() const { return static_cast<size_t>(last - first); }
    };

    /// The list of `robot`, ascending, without itself.
    List of(uint32_t robot) const { return lists_.of(robot); }

    /// Prefetch where the list of `robot` lies, and, some turns later, the list itself.
    void prefetch_place(uint32_t robot) const { prefetch_line(&lists_.begin[robot]); }
    void prefetch(uint32_t robot) const { prefetch_line(lists_.ids.data() + lists_.begin[robot]); }

    /// Whether the last rebuild() changed the list of `robot`; the first one changes all.
    bool changed(uint32_t robot) const { return changed_[robot]; }

    /// The skin that it was made with, m.
    double skin_m() const { return skin_m_; }

  private:
    // While lists are made: all robots by cells, and the pairs of a share's robots.
    class Cells;
    struct Pairs;

    /// Lists of all robots, one after the other.
    struct Lists {
        Swarm<uint32_t> begin;  ///< by robot: where its list begins in ids; and the end
        Swarm<uint32_t> ids;
        List of(uint32_t robot) const {
            return {ids.data() + begin[robot], ids.data() + begin[robot + 1]};
        }
    };

    Lists lists_of(std::span<const Eigen::Vector2d> positions) const;
    void sum_up(Swarm<uint32_t> &begin) const;

    double reach_m_, skin_m_;  ///< see the constructor
    Team &team_;
    Lists lists_;
    std::vector<uint8_t> changed_;  ///< by robot
};

}  // namespace kilotwin

#endif
