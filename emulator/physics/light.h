/// Ambient light as the robots' sensors read it.
#ifndef KILOTWIN_PHYSICS_LIGHT_H
#define KILOTWIN_PHYSICS_LIGHT_H

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kilotwin {

struct Light {
    struct Source {
        Eigen::Vector2d at;
        double peak;    ///< reading that it adds right below it
        double half_m;  ///< distance at which half is left; from afar it falls with its square
    };
    double ambient = 0;  ///< reading without any source
    std::vector<Source> sources;

    /// What the converter reads at a place: 0..1023.
    int16_t at(const Eigen::Vector2d &place) const {
        double sum = ambient;
        for (const auto &source : sources)
            sum += source.peak /
                   (1 + (place - source.at).squaredNorm() / (source.half_m * source.half_m));
        return static_cast<int16_t>(std::clamp(std::floor(sum + 0.5), 0.0, 1023.0));
    }
};

}  // namespace kilotwin

#endif
