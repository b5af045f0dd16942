#include "physics/placement.h"

#include <doctest/doctest.h>

#include <string>

#include "base/errors.h"
#include "base/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_placement {

namespace {

constexpr double RADIUS = 0.085;

std::vector<Pose> place(size_t count, const Arena &arena, uint64_t seed = 1) {
    std::vector<Pose> poses;
    place_uniformly(poses, count, arena, RADIUS, Chance(seed));
    return poses;
}

bool same(const Pose &a, const Pose &b) {
    return a.position == b.position && a.heading == b.heading;
}

}  // namespace

TEST_CASE("no robot starts in another or in a wall") {
    for (const auto &arena : {round_hall(3), square_hall(3)}) {
        auto poses = place(100, arena);
        REQUIRE(poses.size() == 100);
        for (size_t i = 0; i < poses.size(); i++) {
            CHECK(arena.wall_gap(poses[i].position) >= RADIUS);
            for (size_t j = 0; j < i; j++)
                CHECK((poses[i].position - poses[j].position).norm() >= 2 * RADIUS);
        }
    }
}

TEST_CASE("a further robot leaves all others where they were") {
    auto fewer = place(100, round_hall(4)), more = place(101, round_hall(4));
    for (size_t i = 0; i < fewer.size(); i++) CHECK(same(fewer[i], more[i]));
}

TEST_CASE("robots are placed around those already there, which stay") {
    std::vector<Pose> poses = {{{0, 0}, 1}, {{0.5, 0.5}, 2}};
    place_uniformly(poses, 60, square_hall(2.5), RADIUS, Chance(3));
    REQUIRE(poses.size() == 62);
    CHECK(same(poses[1], {{0.5, 0.5}, 2}));
    for (size_t i = 0; i < poses.size(); i++)
        for (size_t j = 0; j < i; j++)
            CHECK((poses[i].position - poses[j].position).norm() >= 2 * RADIUS);
}

TEST_CASE("another seed places otherwise") {
    auto a = place(20, round_hall(4), 1), b = place(20, round_hall(4), 2);
    for (size_t i = 0; i < a.size(); i++) CHECK_FALSE(same(a[i], b[i]));
}

TEST_CASE("start places and headings are spread evenly") {
    auto poses = place(400, round_hall(40));
    int right = 0, upper = 0, inner = 0, east = 0, north = 0;
    for (const auto &pose : poses) {
        right += pose.position.x() > 0;
        upper += pose.position.y() > 0;
        inner += pose.position.norm() < 20 / std::sqrt(2.0);
        east += std::abs(pose.heading) < PI / 2;
        north += pose.heading > 0;
        CHECK(pose.heading >= -PI);
        CHECK(pose.heading < PI);
    }
    // Each is binomial with p = 1/2: 200 +- 10, so 4 standard deviations either way.
    for (int count : {right, upper, inner, east, north}) {
        CHECK(count > 160);
        CHECK(count < 240);
    }
}

TEST_CASE("more robots than fit are refused, with the number of the one too many") {
    CHECK_THROWS_AS(place(2, square_hall(0.2)), EngineError);
    CHECK_THROWS_WITH(
        place(2, square_hall(0.2)),
        "robot 2 finds no free place in the arena: use fewer robots or a larger arena");
    CHECK_THROWS_AS(place(1, square_hall(0.16)), EngineError);
    CHECK_THROWS_AS(place(100, round_hall(1)), EngineError);
}

}  // namespace test_placement
