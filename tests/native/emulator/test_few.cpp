#include <doctest/doctest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "base/few.h"

using kilotwin::Few;

namespace test_few {

namespace {

struct Pair {
    uint64_t at = 0;
    uint8_t left = 0, right = 0;
    bool operator==(const Pair &) const = default;
};

std::vector<Pair> items(const Few<Pair, 2> &list) { return {list.begin(), list.end()}; }

}  // namespace

TEST_CASE("a list of a few is as a vector, whatever is done to it") {
    Few<Pair, 2> list;
    std::vector<Pair> twin;
    uint64_t draw = 1;
    for (int round = 0; round < 20000; round++) {
        draw = draw * 6364136223846793005u + 1442695040888963407u;
        const Pair item{draw >> 8, static_cast<uint8_t>(draw >> 40), 1};
        const auto place = static_cast<ptrdiff_t>((draw >> 33) % (twin.size() + 1));
        switch ((draw >> 60) & 7) {
        case 0:
        case 1: list.push_back(item), twin.push_back(item); break;
        case 2: list.emplace_back(item.at), twin.emplace_back(item.at); break;
        case 3: {
            const Pair *put = list.insert(list.begin() + place, item);
            CHECK(put == list.begin() + place);
            twin.insert(twin.begin() + place, item);
            break;
        }
        case 4:
            list.erase(list.begin(), list.begin() + place);
            twin.erase(twin.begin(), twin.begin() + place);
            break;
        case 5:
            if (twin.empty()) break;
            list.pop_back(), twin.pop_back();
            break;
        case 6:
            if (place == static_cast<ptrdiff_t>(twin.size())) break;
            CHECK(list.erase(list.begin() + place) == list.begin() + place);
            twin.erase(twin.begin() + place);
            break;
        default:
            if ((draw >> 50 & 15) == 0) list.clear(), twin.clear();
            break;
        }
        REQUIRE(items(list) == twin);
        REQUIRE(list.size() <= list.capacity());
    }
}

TEST_CASE("a copied list is its own, and a list that was moved from is empty") {
    for (const size_t count : {1, 2, 3, 9}) {
        Few<Pair, 2> list;
        while (list.size() < count) list.push_back({list.size(), 0, 0});
        const std::vector<Pair> before = items(list);

        Few<Pair, 2> copy(list), assigned;
        assigned.push_back({99, 0, 0});
        assigned = list;
        list.front().left = 7;
        CHECK(items(copy) == before);
        CHECK(items(assigned) == before);

        Few<Pair, 2> moved(std::move(copy)), taken;
        for (int i = 0; i < 5; i++) taken.emplace_back();
        taken = std::move(assigned);
        CHECK(items(moved) == before);
        CHECK(items(taken) == before);
        CHECK(copy.empty());      // NOLINT(bugprone-use-after-move)
        CHECK(assigned.empty());  // NOLINT(bugprone-use-after-move)
        copy.push_back({1, 2, 3});
        CHECK(items(copy) == std::vector<Pair>{{1, 2, 3}});
    }
}

TEST_CASE("an item of the list itself can be added while the list grows") {
    Few<Pair, 2> list;
    list.push_back({5, 1, 2});
    for (int i = 0; i < 20; i++) list.push_back(list.front());
    CHECK(items(list) == std::vector<Pair>(21, {5, 1, 2}));
}

TEST_CASE("a cleared list keeps its room, and a resized one its first items") {
    Few<Pair, 2> list;
    list.resize(10);
    CHECK(list.capacity() >= 10);
    const size_t room = list.capacity();
    list.clear();
    CHECK(list.empty());
    CHECK(list.capacity() == room);
    list.push_back({3, 0, 0});
    list.resize(40);
    CHECK(list.front() == Pair{3, 0, 0});
}

}  // namespace test_few
