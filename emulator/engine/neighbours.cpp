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
        auto next = first_;
        for (uint32_t i = 0; i < positions.size(); i++) members_[next[index(positions[i])]++] = i;
    }

    /// Those in the nine cells around a point: in each row, three that lie side by side.
    template <typename Visit> void around(const Eigen::Vector2d &p, Visit visit) const {
        const int column = column_of(p), row = row_of(p);
        const int first = std::max(column - 1, 0), last = std::min(column + 1, columns_ - 1);
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); r++) {
            const auto cell = static_cast<size_t>(r) * static_cast<size_t>(columns_);
            const size_t end = first_[cell + static_cast<size_t>(last) + 1];
            for (size_t k = first_[cell + static_cast<size_t>(first)]; k < end; k++)
                visit(members_[k]);
        }
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
};

}  // namespace

void Neighbours::rebuild(const std::vector<Eigen::Vector2d> &positions) {
    auto old_begin = std::move(begin_);
    auto old_ids = std::move(ids_);
    begin_.assign(1, 0);
    begin_.reserve(positions.size() + 1);
    ids_.clear();
    ids_.reserve(old_ids.size() + old_ids.size() / 8);
    changed_.assign(positions.size(), true);
    if (positions.empty()) return;
    double width = reach_m_ + skin_m_;
    Cells cells(positions, width);
    for (uint32_t i = 0; i < positions.size(); i++) {
        cells.around(positions[i], [&](uint32_t j) {
            if (j != i && (positions[j] - positions[i]).squaredNorm() <= width * width)
                ids_.push_back(j);
        });
        auto first = ids_.begin() + static_cast<ptrdiff_t>(begin_.back());
        std::sort(first, ids_.end());
        if (i + 1 < old_begin.size())
            changed_[i] = !std::equal(first, ids_.end(),
                                      old_ids.begin() + static_cast<ptrdiff_t>(old_begin[i]),
                                      old_ids.begin() + static_cast<ptrdiff_t>(old_begin[i + 1]));
        begin_.push_back(ids_.size());
    }
}

}  // namespace kilotwin
