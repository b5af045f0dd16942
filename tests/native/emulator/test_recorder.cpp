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

TEST_CASE("overlaps count contacts, keep the worst, and give the median to 0.0001") {
    Overlaps overlaps;
    CHECK(overlaps.median() == 0);
    CHECK(overlaps.worst() == 0);
    CHECK(overlaps.contacts() == 0);
    for (int i = 1; i <= 99; i++) overlaps.add(i * 0.0005 + 0.00003);
    CHECK(overlaps.contacts() == 99);
    CHECK(overlaps.worst() == doctest::Approx(0.04953));
    CHECK(overlaps.median() >= 0.02503);
    CHECK(overlaps.median() <= 0.02503 + 0.0001);
}

TEST_CASE("one contact is its own median, and a whole robot in another is not beyond the scale") {
    Overlaps one, huge;
    one.add(0.00314);
    CHECK(one.median() == doctest::Approx(0.0032));
    huge.add(0.9);
    CHECK(huge.worst() == 0.9);
    CHECK(huge.median() > 0.2);
}
