#include "simulation/recorder.h"

#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_recorder {

TEST_CASE("a sample holds poses as float32, LED and site") {
    auto samples = two_robots();
    CHECK(samples.x_m == std::vector<float>{1, -0.5f});
    CHECK(samples.y_m == std::vector<float>{2, 0.25f});
    CHECK(samples.heading_rad == std::vector<float>{3, -1});
    CHECK(samples.led == std::vector<uint8_t>{0x3F, 0});
    CHECK(samples.site == std::vector<uint8_t>{0, 2});
}

}  // namespace test_recorder
