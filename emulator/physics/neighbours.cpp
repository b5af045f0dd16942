#include "physics/neighbours.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kilotwin {

/// Pairs of near robots that a share finds: of two robots of its own, or of one with another that
/// lies in cells before or behind its own.
struct alignas(64) Neighbours::Pairs {
    struct Pair {
        uint32_t one, other;
    };
    Swarm<Pair> inside;
    Swarm<Pair> outside;  ///< `one` is of the share

    /// Calls `visit(robot, near)` for each robot of the share and each one near it.
    template <typename Visit> void for_each(Visit visit) const {
        for (const auto &[one, other] : inside) {
            visit(one, other);
            visit(other, one);
        }
        for (const auto &[one, other] : outside) visit(one, other);
    }
};

/// Square cells as wide as the lists reach, row by row, and the robots in each.
class Neighbours::Cells {
  public:
    Cells(std::span<const Eigen::Vector2d> positions, double width_m, Team &team);

    /// Pairs within `reach_m`, at most the cells' width, of a share's robots. A share has a block
    /// of cells, with about as many robots as each other share has.
    Pairs pairs_of(uint32_t share, double reach_m) const;

    /// Calls `visit(robot, is_inside)` for the robots of a share and of the cells around its own,
    /// ascending. All that are near one inside are of the share.
    template <typename Visit> void for_each_around(uint32_t share, Visit visit) const;

    /// Whether a robot is of a share.
    bool is_of(uint32_t share, uint32_t robot) const {
        return cell_[robot] >= shares_[share].cell && cell_[robot] < end_of(share);
    }

  private:
    struct alignas(64) Share {
        Eigen::Vector2d low, high;  ///< of its robots' positions
        Swarm<uint32_t> next;       ///< by cell: how many are in it, then the place of the next
        uint32_t members = 0;       ///< in a part of the cells
        uint32_t cell = 0;          ///< the first of its block
    };

    void find_bounds(double width_m);
    uint32_t cell_of(const Eigen::Vector2d &point) const {
        const Eigen::Vector2d way = point - low_;
        return static_cast<uint32_t>(way.y() / width_m_) * columns_ +
               static_cast<uint32_t>(way.x() / width_m_);
    }
    void find_first();
    uint32_t end_of(uint32_t share) const {
        return share + 1 < shares_.size() ? shares_[share + 1].cell
                                          : static_cast<uint32_t>(first_.size() - 1);
    }
    size_t append_near(uint32_t place, uint32_t begin, uint32_t end, double reach_m,
                       Swarm<Pairs::Pair> &pairs, size_t found) const;

    std::span<const Eigen::Vector2d> positions_;
    Team &team_;
    Eigen::Vector2d low_{0, 0};
    double width_m_ = 0;
    uint32_t columns_ = 0, rows_ = 0;
    std::vector<Share> shares_;
    Swarm<uint32_t> cell_;           ///< by robot
    Swarm<uint32_t> first_;          ///< by cell: its first place in members_; and the end
    Swarm<uint32_t> members_;        ///< robots by cells
    Swarm<Eigen::Vector2d> places_;  ///< positions of members_
};

Neighbours::Cells::Cells(std::span<const Eigen::Vector2d> positions, double width_m, Team &team)
    : positions_(positions),
      team_(team),
      shares_(team.size()) {
    find_bounds(width_m);
    const size_t cells = size_t{columns_} * rows_;
    cell_.resize(positions.size());
    first_.resize(cells + 1);
    members_.resize(positions.size());
    places_.resize(positions.size());
    team_.share(positions.size(), [&](uint32_t share, size_t begin, size_t end) {
        auto &count = shares_[share].next;
        count.assign(cells, 0);
        for (size_t i = begin; i < end; i++) count[cell_[i] = cell_of(positions_[i])]++;
    });
    find_first();
    team_.share(positions.size(), [&](uint32_t share, size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const uint32_t place = shares_[share].next[cell_[i]]++;
            members_[place] = static_cast<uint32_t>(i);
            places_[place] = positions_[i];
        }
    });
    for (uint32_t share = 1; share < team_.size(); share++) {
        const size_t place = team_.begin_of(share, members_.size());
        shares_[share].cell = cell_[members_[place]];
    }
}

void Neighbours::Cells::find_bounds(double width_m) {
    team_.share(positions_.size(), [&](uint32_t share, size_t begin, size_t end) {
        auto &[low, high, next, members, cell] = shares_[share];
        low = high = positions_[0];
        for (size_t i = begin; i < end; i++) {
            low = low.cwiseMin(positions_[i]);
            high = high.cwiseMax(positions_[i]);
        }
    });
    low_ = shares_[0].low;
    Eigen::Vector2d high = shares_[0].high;
    for (const Share &share : shares_) {
        low_ = low_.cwiseMin(share.low);
        high = high.cwiseMax(share.high);
    }
    // Never many more cells than robots, however large the arena.
    const double area_m2 = (high - low_).prod();
    width_m_ = std::max(width_m, std::sqrt(area_m2 / static_cast<double>(positions_.size())));
    columns_ = static_cast<uint32_t>((high.x() - low_.x()) / width_m_) + 1;
    rows_ = static_cast<uint32_t>((high.y() - low_.y()) / width_m_) + 1;
}

/// Finds where cells begin, and where in each of them the robots of each share do.
void Neighbours::Cells::find_first() {
    const size_t cells = first_.size() - 1;
    team_.share(cells, [&](uint32_t share, size_t begin, size_t end) {
        uint32_t members = 0;
        for (const Share &counts : shares_)
            for (size_t cell = begin; cell < end; cell++) members += counts.next[cell];
        shares_[share].members = members;
    });
    team_.share(cells, [&](uint32_t share, size_t begin, size_t end) {
        uint32_t place = 0;
        for (uint32_t before = 0; before < share; before++) place += shares_[before].members;
        for (size_t cell = begin; cell < end; cell++) {
            first_[cell] = place;
            for (Share &counts : shares_) {
                const uint32_t members = counts.next[cell];
                counts.next[cell] = place;
                place += members;
            }
        }
    });
    first_[cells] = static_cast<uint32_t>(positions_.size());
}

Neighbours::Pairs Neighbours::Cells::pairs_of(uint32_t share, double reach_m) const {
    const uint32_t first_cell = shares_[share].cell, end_cell = end_of(share);
    const uint32_t own = first_[first_cell], own_end = first_[end_cell];
    const auto cells = static_cast<uint32_t>(first_.size() - 1);
    Pairs pairs;
    size_t inside = 0, outside = 0;
    // The first one of two cells side by side looks into the other.
    const auto look = [&](uint32_t place, uint32_t begin, uint32_t end) {
        if (place < own) {
            begin = std::clamp(begin, own, own_end);
            end = std::clamp(end, own, own_end);
            const size_t before = outside;
            outside = append_near(place, begin, end, reach_m, pairs.outside, outside);
            for (size_t i = before; i < outside; i++)
                std::swap(pairs.outside[i].one, pairs.outside[i].other);
            return;
        }
        const uint32_t middle = std::clamp(own_end, begin, end);
        inside = append_near(place, begin, middle, reach_m, pairs.inside, inside);
        if (middle < end)
            outside = append_near(place, middle, end, reach_m, pairs.outside, outside);
    };
    const uint32_t before = first_cell - std::min(first_cell, columns_ + 1);
    for (uint32_t place = first_[before]; place < own_end; place++) {
        const uint32_t cell = cell_[members_[place]], column = cell % columns_;
        const uint32_t left = column > 0, right = column + 1 < columns_;
        look(place, place + 1, first_[cell + right + 1]);
        if (const uint32_t below = cell + columns_; below < cells)
            look(place, first_[below - left], first_[below + right + 1]);
    }
    pairs.inside.resize(inside);
    pairs.outside.resize(outside);
    return pairs;
}

/// Appends to the first `found` pairs the near ones of the robot at `place` and those from `begin`
/// to `end`. Returns their new number. The list has room for more than that.
size_t Neighbours::Cells::append_near(uint32_t place, uint32_t begin, uint32_t end, double reach_m,
                                      Swarm<Pairs::Pair> &pairs, size_t found) const {
    if (pairs.size() < found + end - begin) pairs.resize(2 * (found + end - begin));
    for (uint32_t k = begin; k < end; k++) {  // without a branch, which could not be predicted
        pairs[found] = {members_[place], members_[k]};
        found += (places_[k] - places_[place]).squaredNorm() <= reach_m * reach_m;
    }
    return found;
}

template <typename Visit>
void Neighbours::Cells::for_each_around(uint32_t share, Visit visit) const {
    const auto cells = static_cast<uint32_t>(first_.size() - 1), around = columns_ + 1;
    const uint32_t first = shares_[share].cell, end = end_of(share);
    const uint32_t begin = first - std::min(first, around), count = end + around - begin;
    const uint32_t inside = first == 0 ? 0 : first + around;
    const uint32_t inside_end = end == cells ? end : end - std::min(end, around);
    for (uint32_t robot = 0; robot < cell_.size(); robot++) {
        const uint32_t cell = cell_[robot];
        if (cell - begin < count) visit(robot, cell >= inside && cell < inside_end);
    }
}

void Neighbours::rebuild(std::span<const Eigen::Vector2d> positions) {
    Lists lists = lists_of(positions);
    const bool is_first = lists_.begin.size() != lists.begin.size();
    changed_.assign(positions.size(), true);
    if (!is_first)
        team_.share(positions.size(), [&](uint32_t /*share*/, size_t begin, size_t end) {
            for (auto robot = static_cast<uint32_t>(begin); robot < end; robot++) {
                const List now = lists.of(robot), old = lists_.of(robot);
                changed_[robot] = !std::equal(now.begin(), now.end(), old.begin(), old.end());
            }
        });
    lists_ = std::move(lists);
}

Neighbours::Lists Neighbours::lists_of(std::span<const Eigen::Vector2d> positions) const {
    Lists lists;
    lists.begin.assign(positions.size() + 1, 0);
    if (positions.empty()) return lists;
    const Cells cells(positions, reach_m_ + skin_m_, team_);
    std::vector<Pairs> pairs(team_.size());
    Swarm<uint32_t> &begin = lists.begin, &ids = lists.ids;
    team_.share([&](uint32_t share) {
        pairs[share] = cells.pairs_of(share, reach_m_ + skin_m_);
        pairs[share].for_each([&](uint32_t robot, uint32_t /*near*/) { begin[robot]++; });
    });
    sum_up(begin);
    Swarm<uint32_t> unsorted(begin.back());
    team_.share([&](uint32_t share) {
        pairs[share].for_each(
            [&](uint32_t robot, uint32_t near) { unsorted[--begin[robot]] = near; });
    });
    // Robots in the list of `i` have `i` in theirs: written in the order of `i`, they are sorted.
    pairs.clear();
    ids.resize(unsorted.size());
    Swarm<uint32_t> next = begin;
    team_.share([&](uint32_t share) {
        cells.for_each_around(share, [&](uint32_t i, bool is_inside) {
            for (size_t k = begin[i]; k < begin[i + 1]; k++)
                if (is_inside || cells.is_of(share, unsorted[k])) ids[next[unsorted[k]]++] = i;
        });
    });
    return lists;
}

/// Makes numbers of items what they are with all before; the last, too.
void Neighbours::sum_up(Swarm<uint32_t> &numbers) const {
    const size_t count = numbers.size();
    std::vector<uint32_t> sums(team_.size());
    team_.share(count, [&](uint32_t share, size_t begin, size_t end) {
        uint32_t *const all = numbers.data();
        std::partial_sum(all + begin, all + end, all + begin);
        sums[share] = end > begin ? numbers[end - 1] : 0;
    });
    team_.share(count, [&](uint32_t share, size_t begin, size_t end) {
        const uint32_t before = std::accumulate(sums.data(), sums.data() + share, uint32_t{0});
        if (before == 0) return;
        for (size_t i = begin; i < end; i++) numbers[i] += before;
    });
}

}  // namespace kilotwin
