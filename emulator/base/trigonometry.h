/// Sine and cosine by our own polynomials: the same bits with every compiler and C library.
#ifndef KILOTWIN_BASE_TRIGONOMETRY_H
#define KILOTWIN_BASE_TRIGONOMETRY_H

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

namespace kilotwin {

constexpr double PI = 3.14159265358979323846;

/// (cos, sin) of an angle in radians, |angle| <= 1e6. Absolute error below 1e-15 within one turn.
Eigen::Vector2d direction(double angle);

/// Where one gets on a path of length 1 that turns on the way, in the frame of its begin.
template <typename Number> struct Arc { Number straight, aside; };

constexpr double SHORT_ARC = 0.5;  ///< rad

/// Coefficients of two polynomials, highest power first.
template <size_t TERMS> using TwoSeries = std::array<std::array<double, 2>, TERMS>;

/// Both side by side: a processor takes two numbers as fast as one.
template <size_t TERMS>
Eigen::Array2d series(const TwoSeries<TERMS> &coefficients, const Eigen::Array2d &x) {
    using Two = Eigen::Map<const Eigen::Array2d>;
    Eigen::Array2d value = Two(coefficients[0].data());
    for (size_t i = 1; i < TERMS; i++) value = value * x + Two(coefficients[i].data());
    return value;
}

// Taylor, in the angle's square; what is left out is below 1e-17. Both components of a short arc,
// but for the last factor of the second.
constexpr TwoSeries<7> SHORT_ARC_SERIES = {{{1.0 / 6227020800, 1.0 / 87178291200},
                                            {-1.0 / 39916800, -1.0 / 479001600},
                                            {1.0 / 362880, 1.0 / 3628800},
                                            {-1.0 / 5040, -1.0 / 40320},
                                            {1.0 / 120, 1.0 / 720},
                                            {-1.0 / 6, -1.0 / 24},
                                            {1.0, 1.0 / 2}}};

/// arc() beyond SHORT_ARC.
Arc<double> long_arc(double angle);

/// A path that turns by `angle` (rad): sin(angle) / angle straight on, (1 - cos(angle)) / angle to
/// the left. Absolute error below 1e-15 within one turn; for angle = 0 exactly (1, 0).
inline Arc<double> arc(double angle) {
    if (std::abs(angle) > SHORT_ARC) return long_arc(angle);
    const double square = angle * angle;
    const Eigen::Array2d both = series(SHORT_ARC_SERIES, Eigen::Array2d(square, square));
    return {both[0], both[1] * angle};
}

/// arc() of two angles, bit for bit, if neither is beyond SHORT_ARC.
inline Arc<Eigen::Array2d> short_arcs(const Eigen::Array2d &angles) {
    using Two = Eigen::Array2d;
    const Two squares = angles * angles;
    // Not one component of both at once: gcc would put two of each coefficient side by side anew.
    const Two one = series(SHORT_ARC_SERIES, Two(squares[0], squares[0]));
    const Two other = series(SHORT_ARC_SERIES, Two(squares[1], squares[1]));
    return {Two(one[0], other[0]), Two(one[1], other[1]) * angles};
}

/// The same angle in [-pi, pi).
double wrapped(double angle);

}  // namespace kilotwin

#endif
