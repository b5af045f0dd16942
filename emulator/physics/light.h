/// Ambient light at a place of the arena, as readings of the robots' sensor.
#ifndef KILOTWIN_PHYSICS_LIGHT_H
#define KILOTWIN_PHYSICS_LIGHT_H

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "physics/arena.h"
#include "physics/raster.h"

namespace kilotwin {

/// Constant during a run. Noise is the converter's, drawn where the sensor is read.
struct Light {
    /// A lamp: adds peak / (1 + (d / half_m)^2) at the distance d.
    struct Source {
        Eigen::Vector2d at;  ///< m
        double peak;         ///< reading that it adds right below it
        double half_m;       ///< distance at which half of that is left, above 0
    };
    double ambient;               ///< reading without any source
    std::vector<Source> sources;  ///< lamps add up, in any order
    Raster picture = {};          ///< what a projector adds: `white` where it is 255
    double white = 0;

    /// Whether it is the same everywhere.
    bool is_even() const { return sources.empty() && picture.empty(); }

    /// The converter's reading at a place of the arena, 0 to 1023, without noise. A lamp behind a
    /// wall that blocks light adds nothing. Linear in sources.
    int16_t at(const Eigen::Vector2d &place, const Arena &arena) const {
        double sum = ambient + white * picture.at(place) / 255;
        for (const auto &source : sources)
            if (arena.lets_light_pass(source.at, place))
                sum += source.peak /
                       (1 + (place - source.at).squaredNorm() / (source.half_m * source.half_m));
        return static_cast<int16_t>(std::clamp(std::floor(sum + 0.5), 0.0, 1023.0));
    }
};

}  // namespace kilotwin

#endif
