#include "base/large_pages.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

using namespace kilotwin;

namespace test_large_pages {

TEST_CASE(
    "an array of a large page or more begins on one, and shorter ones hold what they should") {
    constexpr size_t PAGE = 2 << 20, NUMBERS = PAGE / sizeof(uint64_t);
    for (const size_t count : {size_t{0}, size_t{1}, NUMBERS - 1, NUMBERS, 3 * NUMBERS + 1}) {
        std::vector<uint64_t, LargePages<uint64_t>> numbers(count, 7);
        if (count >= NUMBERS) CHECK(reinterpret_cast<uintptr_t>(numbers.data()) % PAGE == 0);
        numbers.push_back(8);
        CHECK(numbers.size() == count + 1);
        CHECK(numbers.back() == 8);
        for (size_t i = 0; i < count; i++) REQUIRE(numbers[i] == 7);
    }
}

}  // namespace test_large_pages
