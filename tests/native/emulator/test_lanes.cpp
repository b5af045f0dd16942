// Lanes by themselves: places without robots, some of which are active.
#include "infrared/lanes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_lanes {

namespace {

constexpr double REACH_M = 0.1, SKIN_M = 0.01;

/// Robots in a strip, numbered from one end to the other.
struct Strip {
    Strip(size_t robots, double length_m, double width_m, uint64_t seed) {
        Dice dice(seed);
        for (size_t i = 0; i < robots; i++)
            places.emplace_back(dice.between(0, length_m), dice.between(0, width_m));
        std::sort(places.begin(), places.end(),
                  [](const auto &a, const auto &b) { return a.x() < b.x(); });
        lists.rebuild(places);
        for (size_t i = 0; i < robots; i++) active.push_back(dice.between(0, 1) < 0.25);
    }
    bool cut(Lanes &lanes) const {
        return lanes.cut(lists, [this](uint32_t robot) { return active[robot]; });
    }
    /// Whether two robots reach one another or a third.
    bool depend(uint32_t one, uint32_t other) const {
        auto reaches = [this](uint32_t from, uint32_t to) {
            const Neighbours::List list = lists.of(from);
            return from == to || std::find(list.begin(), list.end(), to) != list.end();
        };
        for (uint32_t to = 0; to < places.size(); to++)
            if (reaches(one, to) && reaches(other, to)) return true;
        return false;
    }

    std::vector<Eigen::Vector2d> places;
    Team alone;
    Neighbours lists{REACH_M, SKIN_M, alone};
    std::vector<bool> active;
};

}  // namespace

TEST_CASE("active robots of different lanes reach no common one, nor one of another share") {
    for (const uint32_t members : {2u, 3u, 8u}) {
        CAPTURE(members);
        Team team(members, nullptr);
        size_t joined = 0;
        for (const uint64_t seed : {1, 2, 3, 4, 5}) {
            const Strip strip(400, 20, 0.3, seed);
            Lanes lanes(team, strip.places.size());
            REQUIRE(lanes.count() == members + 1);
            lanes.lists_changed(strip.lists);
            REQUIRE(strip.cut(lanes));
            size_t own = 0;
            for (uint32_t one = 0; one < strip.places.size(); one++) {
                if (!strip.active[one] || lanes.of(one) == lanes.joint()) continue;
                own++;
                REQUIRE(lanes.of(one) == team.share_of(one, strip.places.size()));
                for (const uint32_t reached : strip.lists.of(one))
                    REQUIRE(team.share_of(reached, strip.places.size()) == lanes.of(one));
                for (uint32_t other = 0; other < strip.places.size(); other++)
                    if (strip.active[other] && lanes.of(other) != lanes.of(one))
                        REQUIRE_FALSE(strip.depend(one, other));
            }
            CHECK(own > 20);
            joined += lanes.joined().size();
        }
        CHECK(joined > 0);
    }
}

TEST_CASE("each step finds its lanes anew") {
    Team team(2, nullptr);
    Strip strip(400, 20, 0.3, 4);
    Lanes lanes(team, strip.places.size());
    lanes.lists_changed(strip.lists);
    REQUIRE(strip.cut(lanes));
    REQUIRE(lanes.joined().size() > 0);
    std::fill(strip.active.begin(), strip.active.end(), false);
    REQUIRE(strip.cut(lanes));
    CHECK(lanes.joined().empty());
    for (uint32_t robot = 0; robot < strip.places.size(); robot++)
        REQUIRE(lanes.of(robot) == team.share_of(robot, strip.places.size()));
    lanes.join();
    CHECK_FALSE(lanes.are_cut());
    CHECK(lanes.of(0) == lanes.joint());
}

TEST_CASE("one member, and robots that are numbered anyhow, have the joint lane alone") {
    Team one(1, nullptr), two(2, nullptr);
    Strip strip(400, 20, 0.3, 5);
    Lanes alone(one, strip.places.size());
    CHECK(alone.count() == 1);
    alone.lists_changed(strip.lists);
    CHECK_FALSE(strip.cut(alone));
    CHECK(alone.of(7) == 0);
    // Neighbours have numbers far apart.
    for (size_t i = 1; i < 200; i += 2) std::swap(strip.places[i], strip.places[i + 200]);
    strip.lists.rebuild(strip.places);
    Lanes mixed(two, strip.places.size());
    mixed.lists_changed(strip.lists);
    CHECK_FALSE(strip.cut(mixed));
    CHECK(mixed.of(7) == mixed.joint());
}

}  // namespace test_lanes
