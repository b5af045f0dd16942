/// Selecting and sorting without branches that a processor cannot predict: 7 to 9 % of `walk`
/// (docs/performance.md). Plain loops are the oracle of test_selection.
#ifndef KILOTWIN_BASE_SELECTION_H
#define KILOTWIN_BASE_SELECTION_H

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// Sets `chosen` to those of begin .. end - 1 for which `wanted` holds, ascending. O(end - begin),
/// whatever the share chosen.
template <typename Wanted>
void choose(std::vector<uint32_t> &chosen, size_t begin, size_t end, Wanted wanted) {
    chosen.resize(end - begin);
    size_t n = 0;
    for (auto i = static_cast<uint32_t>(begin); i < end; i++) {
        chosen[n] = i;
        n += wanted(i);
    }
    chosen.resize(n);
}

/// The same of 0 .. count - 1.
template <typename Wanted> void choose(std::vector<uint32_t> &chosen, size_t count, Wanted wanted) {
    choose(chosen, 0, count, wanted);
}

/// Sorts a list of which all but a tail is in order already: sorts the tail, then merges. In time
/// O(list), where the tail is short. For lists that a world step adds a few items to: robots near a
/// contact, and their pairs.
template <typename T> void sort_tail(std::vector<T> &list) {
    const auto tail = std::is_sorted_until(list.begin(), list.end());
    std::sort(tail, list.end());
    std::inplace_merge(list.begin(), tail, list.end());
}

/// Sorts events of one world step by time: a counting sort into short spans, which orders nearly
/// all, then an insertion sort. Linear in mean; its lists are kept from step to step.
template <typename T> class StepSorter {
  public:
    /// `time(item)`: within the step, which begins at `begin` and lasts `step`, a power of two.
    /// `before(a, b)`: a strict order by time, and of equal times by something else.
    template <typename Time, typename Before>
    void sort(std::vector<T> &items, Cycles begin, Cycles step, Time time, Before before) {
        spread(items, begin, step, time);
        for (size_t i = 1; i < items.size(); i++) {
            if (!before(items[i], items[i - 1])) continue;
            T item = std::move(items[i]);
            size_t k = i;
            for (; k > 0 && before(item, items[k - 1]); k--) items[k] = std::move(items[k - 1]);
            items[k] = std::move(item);
        }
    }

  private:
    /// Counting sort: items in order of spans, within a span as they came. Leaves short lists as
    /// they are.
    template <typename Time>
    void spread(std::vector<T> &items, Cycles begin, Cycles step, Time time) {
        constexpr size_t SHORT = 8;
        if (items.size() <= SHORT) return;
        const size_t spans = std::min<size_t>(std::bit_ceil(2 * items.size()), step);
        const int shift = std::countr_zero(step) - std::countr_zero(spans);
        auto span = [&](const T &item) { return (time(item) - begin) >> shift & (spans - 1); };
        first_.assign(spans + 1, 0);
        for (const T &item : items) first_[span(item) + 1]++;
        for (size_t i = 1; i < spans; i++) first_[i] += first_[i - 1];
        sorted_.resize(items.size());
        for (const T &item : items) sorted_[first_[span(item)]++] = item;
        items.swap(sorted_);
    }

    std::vector<uint32_t> first_;  ///< by span: where its items begin in sorted_
    std::vector<T> sorted_;        ///< items in order of spans, until they are swapped in
};

}  // namespace kilotwin

#endif
