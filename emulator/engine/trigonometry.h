/// Sine and cosine by our own polynomials: the same bits with every compiler and C library.
#ifndef KILOTWIN_ENGINE_TRIGONOMETRY_H
#define KILOTWIN_ENGINE_TRIGONOMETRY_H

#include <Eigen/Core>
#include <cstddef>
#include <iterator>

namespace kilotwin {

constexpr double PI = 3.14159265358979323846;

/// (cos, sin) of an angle in radians, |angle| <= 1e6. Absolute error below 1e-15 within one turn.
Eigen::Vector2d direction(double angle);

/// Where one gets on a path of length 1 that turns on the way, in the frame of its begin.
template <typename Number> struct Arc { Number straight, aside; };

/// A path that turns by `angle` (rad): sin(angle) / angle straight on, (1 - cos(angle)) / angle to
/// the left. Absolute error below 1e-15 within one turn; for angle = 0 exactly (1, 0).
Arc<double> arc(double angle);

constexpr double SHORT_ARC = 0.5;  ///< rad

/// The same, bit for bit, for |angle| <= SHORT_ARC; or of two angles, if Number is Eigen::Array2d:
/// two numbers cost a processor no more than one.
template <typename Number> Arc<Number> short_arc(const Number &angle) {
    // Taylor, highest power of the angle's square first; what is left out is below 1e-17.
    constexpr double STRAIGHT[] = {1.0 / 6227020800, -1.0 / 39916800, 1.0 / 362880, -1.0 / 5040,
                                   1.0 / 120,        -1.0 / 6,        1.0};
    constexpr double ASIDE[] = {1.0 / 87178291200, -1.0 / 479001600, 1.0 / 3628800, -1.0 / 40320,
                                1.0 / 720,         -1.0 / 24,        1.0 / 2};
    const Number square = angle * angle;
    Number straight = STRAIGHT[0] * square + STRAIGHT[1];
    Number aside = ASIDE[0] * square + ASIDE[1];
    for (size_t i = 2; i < std::size(STRAIGHT); i++) {
        straight = straight * square + STRAIGHT[i];
        aside = aside * square + ASIDE[i];
    }
    return {straight, aside * angle};
}

/// The same angle in [-pi, pi).
double wrapped(double angle);

}  // namespace kilotwin

#endif
