#include "grid/cells.h"

#include <string>

#include "base/errors.h"

namespace kilotwin {

GridLayout::GridLayout(uint32_t columns, uint32_t rows, uint32_t buses)
    : columns_(columns),
      rows_(rows),
      buses_(buses),
      corner_(-MODULE_M / 2 * columns, -MODULE_M / 2 * rows) {
    if (columns < 1 || columns > MOST_COLUMNS || rows < 1 || rows > MOST_ROWS)
        throw EngineError("a grid has 1 to 31 columns and rows, not " + std::to_string(columns) +
                          " x " + std::to_string(rows));
    if (buses < 1 || buses > rows)
        throw EngineError("a grid of " + std::to_string(rows) + " rows has 1 to " +
                          std::to_string(rows) + " buses, not " + std::to_string(buses));
    for (uint32_t bus = 0; bus < buses; bus++) {
        uint32_t modules = columns * (first_row(bus + 1) - first_row(bus));
        if (modules > MOST_MODULES_PER_BUS)
            throw EngineError("bus " + std::to_string(bus) + " would have " +
                              std::to_string(modules) +
                              " modules; 112 is the most, so split the rows over more buses");
    }
}

uint32_t GridLayout::bus_of_row(uint32_t row) const {
    // The last bus that begins at or below the row. The division rounds down, so the estimate may
    // be too low.
    uint32_t bus = row * buses_ / rows_;
    while (bus + 1 < buses_ && first_row(bus + 1) <= row) bus++;
    return bus;
}

Eigen::Vector2d GridLayout::centre(uint32_t cell) const {
    return corner_ + CELL_M * Eigen::Vector2d(cell_column(cell) + 0.5, cell_row(cell) + 0.5);
}

// NaN is outside too, so the test asks for what is inside.
std::optional<uint32_t> GridLayout::below(const Eigen::Vector2d &place) const {
    const Eigen::Vector2d from = (place - corner_) / CELL_M;
    const double column = std::floor(from.x()), row = std::floor(from.y());
    if (!(column >= 0 && column < 2 * columns_ && row >= 0 && row < 2 * rows_)) return std::nullopt;
    return cell(static_cast<uint32_t>(column), static_cast<uint32_t>(row));
}

}  // namespace kilotwin
