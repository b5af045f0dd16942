/// Neighbour lists: for each robot the robots around it, within a reach and a skin, as in a Verlet
/// list. They hold until two robots together have moved by more than the skin; Bodies keeps track
/// of that. Both contacts and channels look for robots in these lists only.
#ifndef KILOTWIN_PHYSICS_NEIGHBOURS_H
#define KILOTWIN_PHYSICS_NEIGHBOURS_H

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "base/prefetch.h"

namespace kilotwin {

/// Memory: about 40 bytes a robot and 32 a pair of robots in reach, of which there may be 2^31.
class Neighbours {
  public:
    /// A list has all robots within `reach_m` + `skin_m` (m, above 0) at the time of rebuild().
    Neighbours(double reach_m, double skin_m) : reach_m_(reach_m), skin_m_(skin_m) {}

    /// Makes all lists from the robots' positions, m. O(robots + pairs): robots are sorted into
    /// square cells as wide as the lists reach. Memory is kept for the next time.
    void rebuild(std::span<const Eigen::Vector2d> positions);

    /// A view of one list. Valid until the next rebuild().
    struct List {
        const uint32_t *first, *last;
        const uint32_t *begin() const { return first; }
        const uint32_t *end() const { return last; }
        size_t size() const { return static_cast<size_t>(last - first); }
    };

    /// The list of `robot`, ascending, without itself.
    List of(uint32_t robot) const { return list(ids_, begin_, robot); }

    /// Prefetch where the list of `robot` lies, and, some turns later, the list itself.
    void prefetch_place(uint32_t robot) const { prefetch_line(&begin_[robot]); }
    void prefetch(uint32_t robot) const { prefetch_line(ids_.data() + begin_[robot]); }

    /// Whether the last rebuild() changed the list of `robot`. Linear in its length.
    bool changed(uint32_t robot) const {
        if (old_begin_.empty()) return true;
        const List now = of(robot), before = list(old_ids_, old_begin_, robot);
        return !std::equal(now.begin(), now.end(), before.begin(), before.end());
    }

    /// The skin that it was made with, m.
    double skin_m() const { return skin_m_; }

  private:
    /// Two robots in each other's lists.
    struct Pair {
        uint32_t one, other;
    };

    static List list(const Swarm<uint32_t> &ids, const Swarm<uint32_t> &begin, uint32_t robot) {
        return {ids.data() + begin[robot], ids.data() + begin[robot + 1]};
    }

    // The steps of rebuild(), in order.
    void sort_into_cells(std::span<const Eigen::Vector2d> positions);
    void find_pairs();
    /// Adds the pairs of the member at `place` with those from `begin` to `end`. Returns how many
    /// pairs there are then.
    size_t add_pairs(size_t place, size_t begin, size_t end, size_t found);
    void list_pairs();

    double reach_m_, skin_m_;    ///< see the constructor
    Swarm<uint32_t> begin_;      ///< by robot: where its list begins in ids_; and the end
    Swarm<uint32_t> ids_;        ///< all lists
    Swarm<uint32_t> old_begin_;  ///< of the lists before the last rebuild()
    Swarm<uint32_t> old_ids_;

    // While lists are made.
    size_t columns_ = 0;                   ///< of cells
    std::vector<uint32_t> cell_;           ///< by robot
    std::vector<size_t> first_;            ///< by cell: its first place in members_
    std::vector<uint32_t> members_;        ///< robots by cells
    std::vector<Eigen::Vector2d> places_;  ///< positions of members_
    std::vector<Pair> pairs_;
    std::vector<uint32_t> unsorted_;  ///< lists in any order
    std::vector<uint32_t> next_;      ///< by robot: where its list goes on
};

}  // namespace kilotwin

#endif
