#include "engine/neighbours.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

namespace {

/// Robots sorted into square cells as wide as the lists reach.
class Cells {
  public:
    Cells(const std::vector<Eigen::Vector2d> &positions, double width) {
        Eigen::Vector2d low = positions[0], high = positions[0];
        for (const auto &p : positions) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
        // Never many more cells than robots, however large the arena.
        double sparse = std::sqrt((high - low).prod() / static_cast<double>(positions.size()));
        width_ = std::max(width, sparse);
        low_ = low;
        columns_ = static_cast<int>((high.x() - low.x()) / width_) + 1;
        rows_ = static_cast<int>((high.y() - low.y()) / width_) + 1;
        first_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_) + 1, 0);
        for (const auto &p : positions) first_[index(p) + 1]++;
        for (size_t i = 1; i < first_.size(); i++) first_[i] += first_[i - 1];
        members_.resize(positions.size());
        places_.resize(positions.size());
        auto next = first_;
        for (uint32_t i = 0; i < positions.size(); i++) {
            const size_t place = next[index(positions[i])]++;
            members_[place] = i;
            places_[place] = positions[i];
        }
    }

    /// Adds to the first `count` of `found`, which is made longer as needed, those nearer to a robot than `reach_m`.
    size_t find(uint32_t robot, const Eigen::Vector2d &p, double reach_m,
                std::vector<uint32_t> &found, size_t count) const {
        // Nine cells: in each row, three that lie side by side.
        const int column = column_of(p), row = row_of(p);
        const int first = std::max(column - 1, 0), last = std::min(column + 1, columns_ - 1);
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); r++) {
            const auto cell = static_cast<size_t>(r) * static_cast<size_t>(columns_);
            const size_t begin = first_[cell + static_cast<size_t>(first)];
            const size_t end = first_[cell + static_cast<size_t>(last) + 1];
            if (found.size() < count + end - begin) found.resize(2 * (count + end - begin));
            for (size_t k = begin; k < end; k++) {  // no branch: nobody could foresee it
                found[count] = members_[k];
                const bool near = (places_[k] - p).squaredNorm() <= reach_m * reach_m;
                count += near & (members_[k] != robot);
            }
        }
        return count;
    }

  private:
    int column_of(const Eigen::Vector2d &p) const {
        return static_cast<int>((p.x() - low_.x()) / width_);
    }
    int row_of(const Eigen::Vector2d &p) const {
        return static_cast<int>((p.y() - low_.y()) / width_);
    }
    size_t index(const Eigen::Vector2d &p) const {
        return static_cast<size_t>(row_of(p)) * static_cast<size_t>(columns_) +
               static_cast<size_t>(column_of(p));
    }

    double width_;
    Eigen::Vector2d low_;
    int columns_, rows_;
    std::vector<size_t> first_;
    std::vector<uint32_t> members_;
    std::vector<Eigen::Vector2d> places_;  ///< theirs
};

}  // namespace

void Neighbours::rebuild(const std::vector<Eigen::Vector2d> &positions) {
    const auto old_begin = std::move(begin_);
    const auto old_ids = std::move(ids_);
    const size_t robots = positions.size();
    begin_.assign(1, 0);
    begin_.reserve(robots + 1);
    changed_.assign(robots, true);
    ids_.clear();
    if (robots == 0) return;
    const double reach_m = reach_m_ + skin_m_;
    const Cells cells(positions, reach_m);
    size_t count = 0;
    for (uint32_t i = 0; i < robots; i++) {
        count = cells.find(i, positions[i], reach_m, found_, count);
        begin_.push_back(count);
    }
    // Whoever has found `i` stands in the list of `i`: written in the finders' order, it is sorted.
    ids_.resize(count);
    next_.assign(begin_.begin(), begin_.end() - 1);
    for (uint32_t i = 0; i < robots; i++)
        for (size_t k = begin_[i]; k < begin_[i + 1]; k++) ids_[next_[found_[k]]++] = i;
    for (uint32_t i = 0; i + 1 < old_begin.size(); i++)
        changed_[i] = !std::equal(ids_.begin() + static_cast<ptrdiff_t>(begin_[i]),
                                  ids_.begin() + static_cast<ptrdiff_t>(begin_[i + 1]),
                                  old_ids.begin() + static_cast<ptrdiff_t>(old_begin[i]),
                                  old_ids.begin() + static_cast<ptrdiff_t>(old_begin[i + 1]));
}

}  // namespace kilotwin
