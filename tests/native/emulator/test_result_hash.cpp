#include "simulation/result_hash.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_result_hash {

namespace {

uint64_t value_of(const ResultHash &hash) { return hash.value(two_robots(), {}, {}); }

uint64_t value_of(const Samples &samples) {
    ResultHash hash;
    hash.take(samples);
    return value_of(hash);
}

}  // namespace

TEST_CASE("the final hash is FNV-1a of poses and LEDs in the order of robots") {
    // From the 26 bytes by an FNV-1a written elsewhere.
    CHECK(final_hash(two_robots()) == 0xfc30278ed2cfbc71);
    CHECK(final_hash({}) == 0xCBF29CE484222325);
}

TEST_CASE("the final hash sees the last bit of a pose, the LED and the order, and nothing else") {
    auto base = final_hash(two_robots());
    auto samples = two_robots();
    samples.y_m[1] = std::nextafter(samples.y_m[1], 1.0f);
    CHECK(final_hash(samples) != base);
    samples = two_robots();
    samples.led[0] = 0x3E;
    CHECK(final_hash(samples) != base);
    samples = {};
    samples.add_robot({{-0.5, 0.25}, -1}, 0, 2);
    samples.add_robot({{1, 2}, 3}, 0x3F, 0);
    CHECK(final_hash(samples) != base);
    samples = two_robots();
    samples.site = {7, 7};
    samples.tick = {99};
    CHECK(final_hash(samples) == base);
}

TEST_CASE("the result's hash sees every sample, its tick and its sites") {
    const auto base = value_of(two_robots());
    const std::function<void(Samples &)> changes[] = {
        [](Samples &samples) { samples.tick[0] = 1; },
        [](Samples &samples) { samples.x_m[0] = std::nextafter(samples.x_m[0], 2.0f); },
        [](Samples &samples) { samples.y_m[1] = std::nextafter(samples.y_m[1], 1.0f); },
        [](Samples &samples) { samples.heading_rad[0] = -samples.heading_rad[0]; },
        [](Samples &samples) { samples.led[1] = 1; },
        [](Samples &samples) { samples.site[1] = 0; },
        [](Samples &samples) { std::swap(samples.x_m[0], samples.x_m[1]); },
    };
    for (const auto &change : changes) {
        auto samples = two_robots();
        change(samples);
        CHECK(value_of(samples) != base);
    }
}

TEST_CASE("samples of one fetch and of several have one hash") {
    ResultHash at_once, one_by_one;
    auto samples = two_robots();
    at_once.take(samples);
    one_by_one.take(samples);
    auto next = samples;
    next.tick.push_back(30);
    next.add_robot({{1.5, 2}, 3}, 0x3F, 0);
    next.add_robot({{-0.5, 0.5}, -1}, 0, 2);
    at_once.take(next);
    Samples alone;
    alone.tick.push_back(30);
    alone.add_robot({{1.5, 2}, 3}, 0x3F, 0);
    alone.add_robot({{-0.5, 0.5}, -1}, 0, 2);
    one_by_one.take(alone);
    CHECK(value_of(at_once) == value_of(one_by_one));
}

TEST_CASE("the result's hash sees prints and failures in any order, but no notes") {
    const Event print{1000, 3, 7, "a", EventKind::PRINT, "7\n"};
    const Event crash{2000, 4, 8, "a", EventKind::CRASH, "at 0x1234"};
    const auto with = [](const Events &events) {
        ResultHash hash;
        hash.take(events, 500);
        return value_of(hash);
    };
    const auto base = with({print, crash});
    CHECK(with({crash, print}) == base);
    CHECK(with({print}) != base);
    for (int change = 0; change < 5; change++) {
        Event other = print;
        if (change == 0) other.at++;
        if (change == 1) other.robot++;
        if (change == 2) other.tick++;
        if (change == 3) other.kind = EventKind::ENDLESS;
        if (change == 4) other.text = "8\n";
        CHECK(with({other, crash}) != base);
    }
    for (EventKind kind : {EventKind::NOTE, EventKind::BUSY_WAIT})
        CHECK(with({print, crash, {3000, 0, 9, "a", kind, "words"}}) == base);
    // Addresses in a crash's text are those of a build.
    Event elsewhere = crash;
    elsewhere.text = "at 0x4321";
    CHECK(with({print, elsewhere}) == base);
}

TEST_CASE("the result's hash sees the end and each count of frames") {
    const ResultHash none;
    const auto base = value_of(none);
    CHECK(none.value({}, {}, {}) != base);
    uint64_t ChannelCounts::*const counts[] = {
        &ChannelCounts::sent,           &ChannelCounts::received,
        &ChannelCounts::wrong_crc,      &ChannelCounts::attempts_failed,
        &ChannelCounts::collided,       &ChannelCounts::deaf,
        &ChannelCounts::lost,           &ChannelCounts::above_sent,
        &ChannelCounts::above_received,
    };
    for (const auto count : counts) {
        ChannelCounts one;
        one.*count = 1;
        CHECK(none.value(two_robots(), one, {}) != base);
    }
    CHECK(none.value(two_robots(), {}, {{1, 0}, {0, 0}}) !=
          none.value(two_robots(), {}, {{0, 0}, {1, 0}}));
    CHECK(none.value(two_robots(), {}, {{1, 0}}) != none.value(two_robots(), {}, {{0, 1}}));
}

}  // namespace test_result_hash
