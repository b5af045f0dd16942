#include "physics/arena.h"

#include <doctest/doctest.h>

#include <cmath>

#include "base/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_arena {

namespace {

const Region DISC = {Region::Shape::CIRCLE, {1, 2}, {0.8, 0.8}};
const Region BOX = {Region::Shape::RECTANGLE, {-1, 0.5}, {2, 1}};
const Region ELL =
    Region::polygon({{-3, -3}, {0, -3}, {0, -2.5}, {-2.2, -2.5}, {-2.5, -1}, {-3, -1}});

}  // namespace

TEST_CASE("a disc contains what is within its diameter, edge included") {
    CHECK(DISC.contains({1, 2}));
    CHECK(DISC.contains({1.4, 2}));
    CHECK(DISC.contains({1, 1.6}));
    CHECK_FALSE(DISC.contains({1.4000001, 2}));
    CHECK_FALSE(DISC.contains({1.3, 2.3}));
}

TEST_CASE("a rectangle contains what is within its sides, edge included") {
    CHECK(BOX.contains({-1, 0.5}));
    CHECK(BOX.contains({0, 1}));
    CHECK(BOX.contains({-2, 0}));
    CHECK_FALSE(BOX.contains({1e-9, 0.5}));
    CHECK_FALSE(BOX.contains({-1, 1.0000001}));
}

TEST_CASE("a polygon contains what is within its edges") {
    CHECK(ELL.contains({-2.9, -1.1}));
    CHECK(ELL.contains({-0.1, -2.6}));
    CHECK_FALSE(ELL.contains({-1, -1.5}));
    CHECK_FALSE(ELL.contains({-3.1, -2}));
    CHECK(ELL.distance_to_edge({-1, -2}) == doctest::Approx(0.5));
    CHECK(ELL.distance_to_edge({-1, -2.8}) == doctest::Approx(0.2));
    CHECK(ELL.distance_to_edge({1, -3}) == doctest::Approx(1));
}

TEST_CASE("a turned rectangle is a polygon, and a turned polygon one of the same size") {
    const Region turned = Region{Region::Shape::RECTANGLE, {0, 0}, {2, 1}}.placed({3, 4}, PI / 2);
    CHECK(turned.shape == Region::Shape::POLYGON);
    CHECK((turned.size - Eigen::Vector2d(1, 2)).norm() < 1e-12);
    CHECK((turned.centre - Eigen::Vector2d(3, 4)).norm() < 1e-12);
    const Region back = turned.placed({0, 0}, -PI / 2);
    CHECK(back.contains({4.9, -2.6}));
    CHECK_FALSE(back.contains({4.9, -3.6}));
}

TEST_CASE("distances to an edge have known values on either side") {
    CHECK(DISC.distance_to_edge({1, 2}) == doctest::Approx(0.4));
    CHECK(DISC.distance_to_edge({1.3, 2}) == doctest::Approx(0.1));
    CHECK(DISC.distance_to_edge({2, 2}) == doctest::Approx(0.6));
    CHECK(BOX.distance_to_edge({-1, 0.5}) == doctest::Approx(0.5));
    CHECK(BOX.distance_to_edge({-0.1, 0.5}) == doctest::Approx(0.1));
    CHECK(BOX.distance_to_edge({1, 0.5}) == doctest::Approx(1));
    CHECK(BOX.distance_to_edge({-1, 2}) == doctest::Approx(1));
}

TEST_CASE("a distance to an edge never promises more way than there is") {
    Dice dice(1);
    for (const auto &region : {DISC, BOX, ELL})
        for (int i = 0; i < 20'000; i++) {
            Eigen::Vector2d here(dice.between(-4, 4), dice.between(-4, 4));
            double free = region.distance_to_edge(here);
            Eigen::Vector2d there = here + free * 0.999999 * direction(dice.between(-PI, PI));
            CHECK(region.contains(here) == region.contains(there));
        }
}

TEST_CASE("sites are numbered in their order, and no site is 0") {
    Arena arena = round_hall(10);
    arena.sites = {DISC, BOX};
    CHECK(arena.site_at({1, 2}) == 1);
    CHECK(arena.site_at({-1, 0.5}) == 2);
    CHECK(arena.site_at({3, 3}) == 0);
    CHECK(arena.distance_to_site_edge({1.3, 2}) == doctest::Approx(0.1));
    CHECK(round_hall(10).distance_to_site_edge({1, 1}) == INFINITY);
}

TEST_CASE("a round wall is one, straight outward") {
    Arena arena = round_hall(4);
    CHECK(arena.wall_gap({0, 0}) == doctest::Approx(2));
    CHECK(arena.wall_gap({0, -1.5}) == doctest::Approx(0.5));
    CHECK(arena.wall_gap({3, 0}) == doctest::Approx(-1));
    int walls = 0;
    arena.for_each_wall({0, -1.5}, 1, [&](double gap, const Eigen::Vector2d &outward, uint32_t) {
        walls++;
        CHECK(gap == doctest::Approx(0.5));
        CHECK((outward - Eigen::Vector2d(0, -1)).norm() < 1e-15);
    });
    CHECK(walls == 1);
}

TEST_CASE("a rectangle has four walls, the nearest gives the gap") {
    Arena arena = {{Region::Shape::RECTANGLE, {0, 0}, {4, 2}}, {}};
    CHECK(arena.wall_gap({0, 0}) == doctest::Approx(1));
    CHECK(arena.wall_gap({1.9, 0.5}) == doctest::Approx(0.1));
    CHECK(arena.wall_gap({0, -1.2}) == doctest::Approx(-0.2));
    Eigen::Vector2d sum(0, 0);
    double gaps = 0;
    arena.for_each_wall({0.5, 0.25}, 4, [&](double gap, const Eigen::Vector2d &outward, uint32_t) {
        CHECK(outward.norm() == 1);
        sum += outward;
        gaps += gap;
    });
    CHECK(sum == Eigen::Vector2d(0, 0));
    CHECK(gaps == doctest::Approx(4 + 2));
}

}  // namespace test_arena
