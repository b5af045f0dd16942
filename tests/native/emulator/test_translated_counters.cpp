#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "robots/translated/passes/counters.h"
#include "support.h"

using kilotwin::testing::Dice;

namespace test_translated_counters {

namespace {

/// How often a number that counts on without end has crossed a bound. Code may tell these apart.
int64_t crossings(int64_t number, const translated_bound_t &bound) {
    return (number - int64_t{bound.at}) >> bound.bits;
}

/// Whether so many passes more go the same way as one between two values: each may ask for the
/// variable before and behind its addition.
bool go_the_same_way(const translated_bound_t &bound, int64_t was, int64_t step, uint64_t passes) {
    const int64_t before = crossings(was, bound), behind = crossings(was + step, bound);
    for (int64_t now = was + step; passes > 0; passes--, now += step)
        if (crossings(now, bound) != before || crossings(now + step, bound) != behind) return false;
    return true;
}

}  // namespace

TEST_CASE("a pass that counts is repeated only as often as it goes the same way") {
    Dice dice(3);
    for (int round = 0; round < 20000; round++) {
        const auto bits = static_cast<uint8_t>(5 + dice.below(5));  // more than a step
        const translated_bound_t bound = {0, bits, dice.below(1u << bits)};
        const auto was = static_cast<int64_t>(dice.below(1000));
        const auto step = static_cast<int64_t>(dice.below(17)) - 8;
        const uint64_t room =
            translated_room(&bound, static_cast<uint32_t>(was), static_cast<uint32_t>(was + step));
        CHECK(go_the_same_way(bound, was, step, std::min<uint64_t>(room, 2000)));
    }
}

TEST_CASE("passes that count are left out up to few before one that goes another way") {
    const translated_bound_t bound = {0, 16, 1000};
    CHECK(translated_room(&bound, 10, 11) == 988);
    CHECK(translated_room(&bound, 10, 13) == 328);
    CHECK(translated_room(&bound, 1010, 1009) == 9);
    CHECK(translated_room(&bound, 997, 998) == 1);
    CHECK(translated_room(&bound, 998, 999) == 0);
    CHECK(translated_room(&bound, 1000, 1001) == 65534);
    CHECK(translated_room(&bound, 5, 5) == UINT64_MAX);
}

TEST_CASE("counters of several widths go on together, up to the first bound") {
    constexpr std::array<translated_counter_t, 3> COUNTERS = {{{0x100, 1}, {0x101, 2}, {0x110, 4}}};
    constexpr std::array<translated_bound_t, 2> BOUNDS = {{{1, 16, 2000}, {2, 32, 90000}}};
    const translated_counters_t all = {COUNTERS.size(), COUNTERS.data(), BOUNDS.size(),
                                       BOUNDS.data()};
    std::array<uint8_t, 0x900> data = {};
    translated_pass_t pass = {};
    translated_note_counters(&all, data.data(), &pass);
    CHECK(translated_added(&all, data.data(), &pass) == 0);
    data[0x100] = 0xFF;  // one less
    data[0x101] = 10;
    data[0x110] = 100;
    const uint64_t net = translated_weight(0x100) * 0xFF + translated_weight(0x101) * 10 +
                         translated_weight(0x110) * 100;
    CHECK(translated_added(&all, data.data(), &pass) == net);
    SUBCASE("as far as there is room") {
        CHECK(translated_count_on(&all, data.data(), &pass, 50) == 50);
        CHECK(data[0x100] == 0xFF - 50);
        CHECK((data[0x101] | data[0x102] << 8) == 510);
        CHECK((data[0x110] | data[0x111] << 8 | data[0x112] << 16) == 5100);
    }
    SUBCASE("up to the bound of one of them") {
        CHECK(translated_count_on(&all, data.data(), &pass, 5000) == 198);
        CHECK((data[0x101] | data[0x102] << 8) == 1990);
    }
}

}  // namespace test_translated_counters
