/// Layout of a Kilogrid: conversions between module, cell, position and CAN bus.
///
/// The grid's centre is the arena's centre, (0, 0). A module is 10 cm wide and has 2 x 2 cells;
/// module (x, y) = (column, row) counts from the lower left, y upwards. Cells of a module: 0 top
/// left, 1 top right, 2 bottom left, 3 bottom right (hardware.md 3.1). Buses have whole rows, as
/// equally as possible, the lowest rows first. Positions are in m.
///
/// Two numberings: modules row by row from the lower left, 0 to modules() - 1; cells by module and
/// its cell, 0 to cells() - 1. Arguments are not checked but by the constructor.
#ifndef KILOTWIN_GRID_CELLS_H
#define KILOTWIN_GRID_CELLS_H

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "dimensions.h"

namespace kilotwin {

constexpr double CELL_M = KILOGRID_CELL_MM / 1000.0;  ///< width and height
constexpr double MODULE_M = 2 * CELL_M;               ///< likewise

/// Immutable; every conversion is O(1).
class GridLayout {
  public:
    /// Cells of a module.
    static constexpr uint32_t MODULE_CELLS = KILOGRID_MODULE_CELLS;
    /// Limits of the addresses: five bits each, of which one value means all (hardware.md 3.2).
    static constexpr uint32_t MOST_COLUMNS = KILOGRID_MOST_COLUMNS, MOST_ROWS = KILOGRID_MOST_ROWS;
    /// Limit of the dispatcher (hardware.md 3.1).
    static constexpr uint32_t MOST_MODULES_PER_BUS = KILOGRID_MOST_MODULES_PER_BUS;

    /// Throws EngineError for a grid that cannot be wired: no modules, more than 31 x 31, no bus,
    /// more buses than rows, more than 112 modules on a bus.
    GridLayout(uint32_t columns, uint32_t rows, uint32_t buses);

    // Sizes; columns and rows are those of modules.
    uint32_t columns() const { return columns_; }
    uint32_t rows() const { return rows_; }
    uint32_t buses() const { return buses_; }
    // Totals: columns x rows, and four times that.
    uint32_t modules() const { return columns_ * rows_; }
    uint32_t cells() const { return MODULE_CELLS * modules(); }

    // A module by column and row, and back.
    uint32_t module(uint32_t x, uint32_t y) const { return y * columns_ + x; }
    uint32_t x(uint32_t module) const { return module % columns_; }
    uint32_t y(uint32_t module) const { return module / columns_; }

    /// The bus of a module.
    uint32_t bus(uint32_t module) const { return bus_of_row(y(module)); }

    /// First row of a bus; first_row(bus + 1) is the row behind its last.
    uint32_t first_row(uint32_t bus) const { return bus * rows_ / buses_; }

    // The module of a cell, and the cell's index in it, 0..3.
    static uint32_t module_of(uint32_t cell) { return cell / MODULE_CELLS; }
    static uint8_t index_in_module(uint32_t cell) {
        return static_cast<uint8_t>(cell % MODULE_CELLS);
    }

    /// Centre of a cell.
    Eigen::Vector2d centre(uint32_t cell) const;

    // A cell by column and row of cells, counted from the lower left, and back.
    uint32_t cell(uint32_t column, uint32_t row) const {
        const uint32_t left = column % 2, top = row % 2;
        return MODULE_CELLS * module(column / 2, row / 2) + (top ? 0 : 2) + left;
    }
    // Counted in cells, so 0 to 2 * columns() - 1 and 2 * rows() - 1.
    uint32_t cell_column(uint32_t cell) const { return 2 * x(module_of(cell)) + cell % 2; }
    uint32_t cell_row(uint32_t cell) const {
        return 2 * y(module_of(cell)) + (cell % MODULE_CELLS < 2 ? 1 : 0);
    }

    /// The cell below a position; none outside the grid. A border belongs to the cell right of it,
    /// or above it.
    /// Any numbers may be given, infinite ones too.
    std::optional<uint32_t> below(const Eigen::Vector2d &place) const;

    /// Calls visit(cell, distance in m) for every cell whose centre is at most `range_m` away, row
    /// by row from the lower left. O(cells in the square around the range).
    template <typename Visit>
    void for_each_within(const Eigen::Vector2d &place, double range_m, Visit visit) const {
        // In the grid's own coordinates, from its lower left corner.
        const Eigen::Vector2d from = place - corner_;
        const int64_t first_column = first(from.x() - range_m),
                      last_column = last(from.x() + range_m, 2 * columns_),
                      last_row = last(from.y() + range_m, 2 * rows_);
        for (int64_t row = first(from.y() - range_m); row <= last_row; row++)
            for (int64_t column = first_column; column <= last_column; column++) {
                const Eigen::Vector2d middle((static_cast<double>(column) + 0.5) * CELL_M,
                                             (static_cast<double>(row) + 0.5) * CELL_M);
                const double distance = (middle - from).norm();
                if (distance <= range_m)
                    visit(cell(static_cast<uint32_t>(column), static_cast<uint32_t>(row)),
                          distance);
            }
    }

  private:
    /// The bus that a row of modules belongs to.
    uint32_t bus_of_row(uint32_t row) const;

    // Along an axis: the first cell whose centre is not before `from`, and the last not behind
    // `to`.
    static int64_t first(double from) {
        return std::max<int64_t>(static_cast<int64_t>(std::ceil(from / CELL_M - 0.5)), 0);
    }
    static int64_t last(double to, uint32_t count) {
        return std::min<int64_t>(static_cast<int64_t>(std::floor(to / CELL_M - 0.5)),
                                 static_cast<int64_t>(count) - 1);
    }

    uint32_t columns_, rows_, buses_;
    Eigen::Vector2d corner_;  ///< the lower left
};

}  // namespace kilotwin

#endif
