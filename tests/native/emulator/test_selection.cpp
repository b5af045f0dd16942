#include "base/selection.h"

#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using kilotwin::testing::Dice;

namespace test_selection {

namespace {

struct Item {
    Cycles at;
    uint32_t name;
    bool operator==(const Item &other) const { return at == other.at && name == other.name; }
};

bool before(const Item &a, const Item &b) { return a.at != b.at ? a.at < b.at : a.name < b.name; }

}  // namespace

TEST_CASE("those are chosen for which the condition holds, in ascending order") {
    std::vector<uint32_t> chosen = {7, 7, 7};
    choose(chosen, 10, [](uint32_t i) { return i % 3 == 1; });
    CHECK(chosen == std::vector<uint32_t>{1, 4, 7});
    choose(chosen, 4, [](uint32_t) { return true; });
    CHECK(chosen == std::vector<uint32_t>{0, 1, 2, 3});
    choose(chosen, 4, [](uint32_t) { return false; });
    CHECK(chosen.empty());
    choose(chosen, 0, [](uint32_t) { return true; });
    CHECK(chosen.empty());
}

TEST_CASE("a list that is sorted up to its tail is sorted, whatever the tail") {
    for (uint64_t seed = 1; seed <= 300; seed++) {
        Dice dice(seed);
        std::vector<uint32_t> list;
        for (uint32_t count = dice.below(60); list.size() < count;) list.push_back(dice.below(40));
        const size_t head = dice.below(static_cast<uint32_t>(list.size()) + 1);
        std::sort(list.begin(), list.begin() + static_cast<ptrdiff_t>(head));
        auto sorted = list;
        std::sort(sorted.begin(), sorted.end());
        sort_tail(list);
        CHECK(list == sorted);
    }
}

TEST_CASE("what happens within a step is sorted by time, then by name, however it is spread") {
    StepSorter<Item> sorter;
    for (uint64_t seed = 1; seed <= 300; seed++) {
        Dice dice(seed);
        const Cycles step = TICK_CYCLES << dice.below(3), begin = step * dice.below(1000);
        // Anywhere within it; at three moments; all near its begin; all at once.
        const uint32_t spans[] = {static_cast<uint32_t>(step), 3, 100, 1};
        const uint32_t among = spans[seed % 4];
        std::vector<Item> items;
        for (uint32_t count = dice.below(200); items.size() < count;)
            items.push_back({begin + dice.below(among), dice.below(1000)});
        auto sorted = items;
        std::sort(sorted.begin(), sorted.end(), before);
        sorter.sort(
            items, begin, step, [](const Item &item) { return item.at; }, before);
        CHECK(items == sorted);
    }
}

}  // namespace test_selection
