/// Pictures that lie on the floor: a byte for each of their square pixels. Lengths in metres.
#ifndef KILOTWIN_PHYSICS_RASTER_H
#define KILOTWIN_PHYSICS_RASTER_H

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace kilotwin {

/// A pixel's value holds in all of its square; outside the picture it is 0.
class Raster {
  public:
    /// No picture: 0 everywhere.
    Raster() = default;

    /// `values` row by row, the lowest first, each from left to right: whole rows of `columns`.
    /// `low` is the lower left corner, `pixel_m` the side of a pixel, above 0.
    Raster(std::vector<uint8_t> values, size_t columns, const Eigen::Vector2d &low, double pixel_m);

    bool empty() const { return values_.empty(); }

    /// The value at a point.
    uint8_t at(const Eigen::Vector2d &point) const;

    /// Prepares distance_to_other(). Linear in pixels.
    void find_distances();

    /// A lower bound of the distance from a point to the next one of another value, after
    /// find_distances(): too small by less than two pixels along a row or column, and by less than
    /// a third where it is far and aslant. Constant time.
    double distance_to_other(const Eigen::Vector2d &point) const;

  private:
    uint8_t value(ptrdiff_t column, ptrdiff_t row) const;
    bool is_edge(ptrdiff_t column, ptrdiff_t row) const;

    std::vector<uint8_t> values_;
    std::vector<uint16_t> steps_;  ///< to the nearest pixel of another value, as a chess king goes
    ptrdiff_t columns_ = 0, rows_ = 0;
    Eigen::Vector2d low_{0, 0};
    double pixel_m_ = 1;
};

}  // namespace kilotwin

#endif
