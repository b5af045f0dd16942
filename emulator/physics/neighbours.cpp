#include "physics/neighbours.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kilotwin {

void Neighbours::rebuild(std::span<const Eigen::Vector2d> positions) {
    begin_.swap(old_begin_);
    ids_.swap(old_ids_);
    pairs_.clear();
    if (!positions.empty()) {
        sort_into_cells(positions);
        find_pairs();
    }
    begin_.assign(positions.size() + 1, 0);
    list_pairs();
}

/// Sorts robots into square cells as wide as the lists reach.
void Neighbours::sort_into_cells(std::span<const Eigen::Vector2d> positions) {
    Eigen::Vector2d low = positions[0], high = positions[0];
    for (const auto &p : positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    // Never many more cells than robots, however large the arena.
    const double sparse = std::sqrt((high - low).prod() / static_cast<double>(positions.size()));
    const double width = std::max(reach_m_ + skin_m_, sparse);
    auto cells_to = [width](double way_m) { return static_cast<uint32_t>(way_m / width); };
    columns_ = cells_to(high.x() - low.x()) + 1;
    const size_t rows = cells_to(high.y() - low.y()) + 1;

    cell_.resize(positions.size());
    first_.assign(columns_ * rows + 1, 0);
    for (size_t i = 0; i < positions.size(); i++) {
        const Eigen::Vector2d way = positions[i] - low;
        cell_[i] = cells_to(way.y()) * static_cast<uint32_t>(columns_) + cells_to(way.x());
        first_[cell_[i]]++;
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    members_.resize(positions.size());
    places_.resize(positions.size());
    for (size_t i = positions.size(); i-- > 0;) {
        const size_t place = --first_[cell_[i]];
        members_[place] = static_cast<uint32_t>(i);
        places_[place] = positions[i];
    }
}

/// Finds each pair once: of two cells side by side, the first one looks into the other.
void Neighbours::find_pairs() {
    const size_t cells = first_.size() - 1;
    size_t found = 0;
    for (size_t place = 0; place < members_.size(); place++) {
        const size_t cell = cell_[members_[place]], column = cell % columns_;
        const size_t left = column > 0, right = column + 1 < columns_;
        found = add_pairs(place, place + 1, first_[cell + right + 1], found);
        if (const size_t below = cell + columns_; below < cells)
            found = add_pairs(place, first_[below - left], first_[below + right + 1], found);
    }
    pairs_.resize(found);
}

/// Appends to the first `found` pairs the near ones of the member at `place` and those from `begin`
/// to `end`. Returns their new number. pairs_ has room for more than that.
size_t Neighbours::add_pairs(size_t place, size_t begin, size_t end, size_t found) {
    const double reach_m = reach_m_ + skin_m_;
    if (pairs_.size() < found + end - begin) pairs_.resize(2 * (found + end - begin));
    for (size_t k = begin; k < end; k++) {  // without a branch, which could not be predicted
        pairs_[found] = {members_[place], members_[k]};
        found += (places_[k] - places_[place]).squaredNorm() <= reach_m * reach_m;
    }
    return found;
}

void Neighbours::list_pairs() {
    for (const Pair &pair : pairs_) {
        begin_[pair.one]++;
        begin_[pair.other]++;
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    unsorted_.resize(begin_.back());
    for (const Pair &pair : pairs_) {
        unsorted_[--begin_[pair.one]] = pair.other;
        unsorted_[--begin_[pair.other]] = pair.one;
    }
    // Robots in the list of `i` have `i` in theirs: written in the order of `i`, they are sorted.
    if (ids_.capacity() < unsorted_.size()) {  // with some room, and not twice as much
        Swarm<uint32_t>().swap(ids_);
        ids_.reserve(unsorted_.size() + unsorted_.size() / 8);
    }
    ids_.resize(unsorted_.size());
    next_.assign(begin_.begin(), begin_.end());
    for (uint32_t i = 0; i + 1 < begin_.size(); i++)
        for (size_t k = begin_[i]; k < begin_[i + 1]; k++) ids_[next_[unsorted_[k]]++] = i;
}

}  // namespace kilotwin
