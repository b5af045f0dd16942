#include "simulation/recorder.h"

#include <doctest/doctest.h>

#include <cmath>

#include "support.h"

using namespace kilotwin;

namespace {

Samples two_robots() {
    Samples samples;
    samples.tick.push_back(0);
    samples.add_robot({{1, 2}, 3}, 0x3F, 0);
    samples.add_robot({{-0.5, 0.25}, -1}, 0, 2);
    return samples;
}

}  // namespace

TEST_CASE("a sample holds poses as float32, LED and site") {
    auto samples = two_robots();
    CHECK(samples.x_m == std::vector<float>{1, -0.5f});
    CHECK(samples.y_m == std::vector<float>{2, 0.25f});
    CHECK(samples.heading_rad == std::vector<float>{3, -1});
    CHECK(samples.led == std::vector<uint8_t>{0x3F, 0});
    CHECK(samples.site == std::vector<uint8_t>{0, 2});
}
