#include <doctest/doctest.h>

#include <set>

#include "base/errors.h"
#include "grid/cells.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_cells {

TEST_CASE("the grid's middle is the arena's middle, and module 0 is at the lower left") {
    GridLayout grid(10, 20, 4);
    CHECK(grid.modules() == 200);
    CHECK(grid.cells() == 800);
    // Module (0, 0) covers x from -0.5 and y from -1; its cell 2 is the lower left one.
    CHECK(grid.centre(2).x() == doctest::Approx(-0.475));
    CHECK(grid.centre(2).y() == doctest::Approx(-0.975));
    const uint32_t last = GridLayout::MODULE_CELLS * grid.module(9, 19);
    CHECK(grid.centre(last + 1).x() == doctest::Approx(0.475));
    CHECK(grid.centre(last + 1).y() == doctest::Approx(0.975));
}

TEST_CASE("cells of a module are top left, top right, bottom left, bottom right") {
    GridLayout grid(1, 1, 1);
    const double at[4][2] = {{-0.025, 0.025}, {0.025, 0.025}, {-0.025, -0.025}, {0.025, -0.025}};
    for (uint32_t cell = 0; cell < 4; cell++) {
        CAPTURE(cell);
        CHECK(grid.centre(cell).x() == doctest::Approx(at[cell][0]));
        CHECK(grid.centre(cell).y() == doctest::Approx(at[cell][1]));
        CHECK(GridLayout::index_in_module(cell) == cell);
    }
}

TEST_CASE("every cell lies below its own middle, and columns and rows lead back to it") {
    for (auto [columns, rows] : {std::pair{1u, 1u}, {3u, 2u}, {10u, 20u}, {31u, 31u}}) {
        GridLayout grid(columns, rows, rows);
        for (uint32_t cell = 0; cell < grid.cells(); cell++) {
            CAPTURE(cell);
            REQUIRE(grid.below(grid.centre(cell)) == cell);
            REQUIRE(grid.cell(grid.cell_column(cell), grid.cell_row(cell)) == cell);
            const uint32_t module = GridLayout::module_of(cell);
            REQUIRE(grid.module(grid.x(module), grid.y(module)) == module);
        }
    }
}

TEST_CASE("beside the grid there is no cell; a border belongs to the cell right of it or above") {
    GridLayout grid(2, 2, 1);
    CHECK(grid.below({-0.1, -0.1}) == GridLayout::MODULE_CELLS * grid.module(0, 0) + 2);
    CHECK(grid.below({0, 0}) == GridLayout::MODULE_CELLS * grid.module(1, 1) + 2);
    CHECK_FALSE(grid.below({0.1, 0}).has_value());
    CHECK_FALSE(grid.below({0, 0.1}).has_value());
    CHECK_FALSE(grid.below({-0.1001, 0}).has_value());
    CHECK_FALSE(grid.below({5, 5}).has_value());
    CHECK_FALSE(grid.below({NAN, 0}).has_value());
}

TEST_CASE("the cells within a range are those whose middle is, by any place and range") {
    GridLayout grid(3, 4, 2);
    Dice dice(1);
    for (int trial = 0; trial < 500; trial++) {
        Eigen::Vector2d place(dice.between(-0.3, 0.3), dice.between(-0.4, 0.4));
        double range = dice.between(0, 0.15);
        std::set<uint32_t> found;
        grid.for_each_within(place, range, [&](uint32_t cell, double distance) {
            CHECK(distance == doctest::Approx((grid.centre(cell) - place).norm()).epsilon(1e-9));
            CHECK(found.insert(cell).second);
        });
        std::set<uint32_t> expected;
        for (uint32_t cell = 0; cell < grid.cells(); cell++)
            if ((grid.centre(cell) - place).norm() <= range) expected.insert(cell);
        REQUIRE(found == expected);
    }
}

TEST_CASE("buses take whole rows, the lowest first, and as equally as can be") {
    GridLayout grid(10, 20, 4);
    for (uint32_t module = 0; module < grid.modules(); module++)
        CHECK(grid.bus(module) == grid.y(module) / 5);
    for (uint32_t rows = 1; rows <= 31; rows++)
        for (uint32_t buses = 1; buses <= rows; buses++) {
            GridLayout any(1, rows, buses);
            std::vector<uint32_t> count(buses, 0);
            for (uint32_t module = 0; module < any.modules(); module++) {
                const uint32_t bus = any.bus(module);
                REQUIRE(bus < buses);
                REQUIRE(any.y(module) >= any.first_row(bus));
                REQUIRE(any.y(module) < any.first_row(bus + 1));
                count[bus]++;
            }
            auto [least, most] = std::minmax_element(count.begin(), count.end());
            REQUIRE(*most - *least <= 1);
        }
}

TEST_CASE("a grid that cannot be wired is refused") {
    CHECK_THROWS_AS(GridLayout(0, 1, 1), EngineError);
    CHECK_THROWS_AS(GridLayout(1, 0, 1), EngineError);
    CHECK_THROWS_AS(GridLayout(32, 1, 1), EngineError);
    CHECK_THROWS_AS(GridLayout(1, 32, 1), EngineError);
    CHECK_THROWS_AS(GridLayout(2, 2, 0), EngineError);
    CHECK_THROWS_AS(GridLayout(2, 2, 3), EngineError);
    CHECK_THROWS_WITH_AS(GridLayout(10, 20, 1),
                         "bus 0 would have 200 modules; 112 is the most, so split the rows over "
                         "more buses",
                         EngineError);
    CHECK_NOTHROW(GridLayout(28, 4, 1));
    CHECK_THROWS_AS(GridLayout(29, 4, 1), EngineError);
}

}  // namespace test_cells
