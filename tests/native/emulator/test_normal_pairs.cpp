#include "base/normal_pairs.h"

#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using kilotwin::testing::Dice;

namespace test_normal_pairs {

TEST_CASE("two normal draws side by side are those that are drawn one by one, bit for bit") {
    Dice dice(1);
    for (const uint64_t seed : {0ull, 1ull, 0xFFFFFFFFull, 0x100000000ull, ~0ull}) {
        const Chance chance(seed);
        const NormalPairs pairs(chance);
        for (int i = 0; i < 2000; i++) {
            const uint32_t robot = dice.below(UINT32_MAX);
            const uint64_t n = static_cast<uint64_t>(dice.below(UINT32_MAX)) << (i % 33);
            const auto [low, high] = pairs.draw(robot, {Purpose::LOW_GAIN, Purpose::HIGH_GAIN}, n);
            CHECK(low == chance.normal(robot, Purpose::LOW_GAIN, n));
            CHECK(high == chance.normal(robot, Purpose::HIGH_GAIN, n));
        }
    }
}

}  // namespace test_normal_pairs
