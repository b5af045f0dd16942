// Pictures on the floor: what a pixel says holds in its square, and how far it does.
#include "physics/raster.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "base/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_raster {

namespace {

constexpr size_t COLUMNS = 31, ROWS = 23;
constexpr double PIXEL = 0.02;
const Eigen::Vector2d LOW(-0.3, -0.2);

/// Blots of some values on a ground of 0.
std::vector<uint8_t> blots(Dice &dice) {
    std::vector<uint8_t> values(COLUMNS * ROWS, 0);
    for (int blot = 0; blot < 5; blot++) {
        const uint32_t x = dice.below(COLUMNS), y = dice.below(ROWS), side = 1 + dice.below(9);
        const auto value = static_cast<uint8_t>(dice.below(4));
        for (uint32_t row = y; row < std::min<uint32_t>(y + side, ROWS); row++)
            for (uint32_t column = x; column < std::min<uint32_t>(x + side, COLUMNS); column++)
                values[row * COLUMNS + column] = value;
    }
    return values;
}

}  // namespace

TEST_CASE("a point has the value of its pixel, the lowest row first, and none outside") {
    std::vector<uint8_t> values(COLUMNS * ROWS, 0);
    values[0] = 3;
    values[COLUMNS] = 4;
    values[COLUMNS * ROWS - 1] = 5;
    const Raster raster(values, COLUMNS, LOW, PIXEL);
    CHECK(raster.at({-0.29, -0.19}) == 3);
    CHECK(raster.at({-0.29, -0.17}) == 4);
    CHECK(raster.at({-0.27, -0.19}) == 0);
    CHECK(raster.at({-0.3 + 0.02 * 30.5, -0.2 + 0.02 * 22.5}) == 5);
    CHECK(raster.at({-0.301, -0.19}) == 0);
    CHECK(raster.at({-0.29, -0.201}) == 0);
    CHECK(raster.at({9, 9}) == 0);
    CHECK(Raster().at({0, 0}) == 0);
}

TEST_CASE("the distance to another value is a lower bound, and no bad one") {
    Dice dice(3);
    for (int scene = 0; scene < 30; scene++) {
        const auto values = blots(dice);
        Raster raster(values, COLUMNS, LOW, PIXEL);
        raster.find_distances();
        for (int i = 0; i < 300; i++) {
            const Eigen::Vector2d here(dice.between(-0.5, 0.5), dice.between(-0.4, 0.4));
            const double bound = raster.distance_to_other(here);
            CHECK(bound >= 0);
            for (int ray = 0; ray < 40; ray++) {
                const Eigen::Vector2d there =
                    here + 0.999999 * bound * dice.between(0, 1) * direction(dice.between(-PI, PI));
                CHECK(raster.at(there) == raster.at(here));
            }
        }
    }
    // Right in the middle of a square, and beside it.
    std::vector<uint8_t> square(COLUMNS * ROWS, 0);
    for (size_t row = 5; row < 15; row++)
        for (size_t column = 5; column < 15; column++) square[row * COLUMNS + column] = 1;
    Raster raster(square, COLUMNS, LOW, PIXEL);
    raster.find_distances();
    CHECK(raster.distance_to_other(LOW + PIXEL * Eigen::Vector2d(10.5, 10.5)) > 0.08);
    CHECK(raster.distance_to_other(LOW + PIXEL * Eigen::Vector2d(25.5, 10.5)) > 0.2);
    CHECK(raster.distance_to_other(LOW + PIXEL * Eigen::Vector2d(25.5, 10.5)) <= 0.21);
}

TEST_CASE("without another value, and without a picture, there is none near") {
    Raster raster(std::vector<uint8_t>(COLUMNS * ROWS, 0), COLUMNS, LOW, PIXEL);
    raster.find_distances();
    CHECK(raster.distance_to_other({0, 0}) > 100);
    CHECK(Raster().distance_to_other({0, 0}) == INFINITY);
}

TEST_CASE("a site that is drawn counts where no other site is") {
    Arena arena = square_hall(2);
    arena.sites = {{Region::Shape::PICTURE, {0, 0}, {0, 0}},
                   {Region::Shape::CIRCLE, {0, 0}, {0.2, 0.2}}};
    arena.floor = Raster(std::vector<uint8_t>(400, 1), 20, {-0.2, -0.2}, 0.02);
    arena.floor.find_distances();
    CHECK(arena.site_at({0, 0}) == 2);
    CHECK(arena.site_at({0.15, 0.15}) == 1);
    CHECK(arena.site_at({0.25, 0}) == 0);
    CHECK(arena.distance_to_site_edge({0.15, 0}) <= 0.05);
    CHECK(arena.distance_to_site_edge({0.15, 0}) > 0.03);
    CHECK(arena.distance_to_site_edge({0.11, 0}) == doctest::Approx(0.01));
}

}  // namespace test_raster
