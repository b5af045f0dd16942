#include "physics/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kilotwin {

namespace {

constexpr uint16_t FARTHEST = std::numeric_limits<uint16_t>::max();

}  // namespace

Raster::Raster(std::vector<uint8_t> values, size_t columns, const Eigen::Vector2d &low,
               double pixel_m)
    : values_(std::move(values)),
      columns_(static_cast<ptrdiff_t>(columns)),
      rows_(static_cast<ptrdiff_t>(values_.size() / columns)),
      low_(low),
      pixel_m_(pixel_m) {}

uint8_t Raster::value(ptrdiff_t column, ptrdiff_t row) const {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return 0;
    return values_[static_cast<size_t>(row * columns_ + column)];
}

uint8_t Raster::at(const Eigen::Vector2d &point) const {
    const Eigen::Vector2d place = (point - low_) / pixel_m_;
    if (!(place.x() >= 0 && place.y() >= 0)) return 0;
    if (!(place.x() < static_cast<double>(columns_) && place.y() < static_cast<double>(rows_)))
        return 0;
    return value(static_cast<ptrdiff_t>(place.x()), static_cast<ptrdiff_t>(place.y()));
}

/// Whether one of the eight around a pixel has another value.
bool Raster::is_edge(ptrdiff_t column, ptrdiff_t row) const {
    for (ptrdiff_t x = column - 1; x <= column + 1; x++)
        for (ptrdiff_t y = row - 1; y <= row + 1; y++)
            if (value(x, y) != value(column, row)) return true;
    return false;
}

// In two passes, each over the half of the neighbours that it has been at: exact for a king's
// steps.
void Raster::find_distances() {
    steps_.assign(values_.size(), FARTHEST);
    auto steps = [&](ptrdiff_t x, ptrdiff_t y) -> uint16_t & {
        return steps_[static_cast<size_t>(y * columns_ + x)];
    };
    auto take = [&](ptrdiff_t x, ptrdiff_t y, ptrdiff_t other_x, ptrdiff_t other_y) {
        if (other_x < 0 || other_y < 0 || other_x >= columns_ || other_y >= rows_) return;
        const int more = std::min(steps(other_x, other_y) + 1, int{FARTHEST});
        steps(x, y) = std::min(steps(x, y), static_cast<uint16_t>(more));
    };
    for (ptrdiff_t y = 0; y < rows_; y++)
        for (ptrdiff_t x = 0; x < columns_; x++) {
            if (is_edge(x, y)) steps(x, y) = 1;
            take(x, y, x - 1, y);
            for (ptrdiff_t side = -1; side <= 1; side++) take(x, y, x + side, y - 1);
        }
    for (ptrdiff_t y = rows_ - 1; y >= 0; y--)
        for (ptrdiff_t x = columns_ - 1; x >= 0; x--) {
            take(x, y, x + 1, y);
            for (ptrdiff_t side = -1; side <= 1; side++) take(x, y, x + side, y + 1);
        }
}

// The pixels that a king reaches in fewer steps are all alike; beyond them it takes so many sides.
double Raster::distance_to_other(const Eigen::Vector2d &point) const {
    if (empty()) return std::numeric_limits<double>::infinity();
    const Eigen::Vector2d place = (point - low_) / pixel_m_;
    const Eigen::Vector2d most(static_cast<double>(columns_), static_cast<double>(rows_));
    const double outside = (-place).cwiseMax(place - most).maxCoeff();
    if (!(outside < 0)) return std::max(outside, 0.0) * pixel_m_;
    const Eigen::Vector2d pixel(std::floor(place.x()), std::floor(place.y()));
    const Eigen::Vector2d in = place - pixel;
    const double to_side = std::min({in.x(), 1 - in.x(), in.y(), 1 - in.y()});
    const auto column = static_cast<ptrdiff_t>(pixel.x()), row = static_cast<ptrdiff_t>(pixel.y());
    const double sides = steps_[static_cast<size_t>(row * columns_ + column)] - 1;
    return (sides + to_side) * pixel_m_;
}

}  // namespace kilotwin
