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

TEST_CASE("the result's hash is FNV-1a of poses and LEDs in the order of robots") {
    // From the 26 bytes by an FNV-1a written elsewhere.
    CHECK(result_hash(two_robots()) == 0xfc30278ed2cfbc71);
    CHECK(result_hash({}) == 0xCBF29CE484222325);
}

TEST_CASE("the hash sees the last bit of a pose, the LED and the order, and nothing else") {
    auto base = result_hash(two_robots());
    auto samples = two_robots();
    samples.y_m[1] = std::nextafter(samples.y_m[1], 1.0f);
    CHECK(result_hash(samples) != base);
    samples = two_robots();
    samples.led[0] = 0x3E;
    CHECK(result_hash(samples) != base);
    samples = {};
    samples.add_robot({{-0.5, 0.25}, -1}, 0, 2);
    samples.add_robot({{1, 2}, 3}, 0x3F, 0);
    CHECK(result_hash(samples) != base);
    samples = two_robots();
    samples.site = {7, 7};
    samples.tick = {99};
    CHECK(result_hash(samples) == base);
}
