/// Who may come near whom: lists of the robots around each robot, good until somebody has moved too
/// far.
#ifndef KILOTWIN_PHYSICS_NEIGHBOURS_H
#define KILOTWIN_PHYSICS_NEIGHBOURS_H

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/prefetch.h"

namespace kilotwin {

class Neighbours {
  public:
    /// Lists hold everybody within `reach_m` + `skin_m` at the time of rebuild().
    Neighbours(double reach_m, double skin_m) : reach_m_(reach_m), skin_m_(skin_m) {}

    /// Makes all lists anew, from the robots' positions. Time O(robots + pairs).
    void rebuild(const std::vector<Eigen::Vector2d> &positions);

    struct List {
        const uint32_t *first, *last;
        const uint32_t *begin() const { return first; }
        const uint32_t *end() const { return last; }
        size_t size() const { return static_cast<size_t>(last - first); }
    };

    /// The robots around `robot`, in ascending order.
    List of(uint32_t robot) const { return list(ids_, begin_, robot); }

    /// Bring into the cache where the list of `robot` stands, and then, some time later, itself.
    void prefetch_place(uint32_t robot) const { prefetch_line(&begin_[robot]); }
    void prefetch(uint32_t robot) const { prefetch_line(ids_.data() + begin_[robot]); }

    /// Whether the last rebuild() changed the list of `robot`.
    bool changed(uint32_t robot) const {
        if (old_begin_.empty()) return true;
        const List now = of(robot), before = list(old_ids_, old_begin_, robot);
        return !std::equal(now.begin(), now.end(), before.begin(), before.end());
    }

    double skin_m() const { return skin_m_; }

  private:
    struct Pair {
        uint32_t one, other;
    };

    static List list(const std::vector<uint32_t> &ids, const std::vector<size_t> &begin,
                     uint32_t robot) {
        return {ids.data() + begin[robot], ids.data() + begin[robot + 1]};
    }

    void sort_into_cells(const std::vector<Eigen::Vector2d> &positions);
    void find_pairs();
    size_t add_pairs(size_t place, size_t begin, size_t end, size_t found);
    void list_pairs();

    double reach_m_, skin_m_;
    std::vector<size_t> begin_;
    std::vector<uint32_t> ids_;
    std::vector<size_t> old_begin_;  ///< of the lists before the last rebuild()
    std::vector<uint32_t> old_ids_;

    // While lists are made.
    size_t columns_ = 0;                   ///< of cells
    std::vector<uint32_t> cell_;           ///< of each robot
    std::vector<size_t> first_;            ///< of those in each cell, by cells
    std::vector<uint32_t> members_;        ///< robots by cells
    std::vector<Eigen::Vector2d> places_;  ///< theirs
    std::vector<Pair> pairs_;
    std::vector<uint32_t> unsorted_;  ///< the lists in any order
    std::vector<size_t> next_;
};

}  // namespace kilotwin

#endif
