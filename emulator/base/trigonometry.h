/// Sine and cosine by polynomials of our own: the same bits with every compiler and C library, as
/// "same seed, same result" needs.
#ifndef KILOTWIN_BASE_TRIGONOMETRY_H
#define KILOTWIN_BASE_TRIGONOMETRY_H

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

namespace kilotwin {

/// To the nearest double.
constexpr double PI = 3.14159265358979323846;

/// (cos, sin) of an angle in radians, |angle| <= 1e6. Absolute error below 1e-15 within one turn.
Eigen::Vector2d direction(double angle);

/// End of a path of length 1 that turns steadily, as a robot with both motors on drives, in the
/// frame of its begin.
struct Arc {
    double straight, aside;  ///< ahead, and to the left
};

/// Coefficients of two polynomials, highest power first.
template <size_t TERMS> using TwoSeries = std::array<std::array<double, 2>, TERMS>;

/// Both polynomials at x by Horner's rule, as an array of two: the compiler takes them side by
/// side. Inline, as arc() is: each robot is placed by one at each world step.
template <size_t TERMS> Eigen::Array2d series(const TwoSeries<TERMS> &coefficients, double x) {
    using Two = Eigen::Map<const Eigen::Array2d>;
    Eigen::Array2d value = Two(coefficients[0].data());
    for (size_t i = 1; i < TERMS; i++) value = value * x + Two(coefficients[i].data());
    return value;
}

/// The limit between arc()'s two ways, in rad. Up to this angle it takes a series: no call and no
/// table.
constexpr double SHORT_ARC = 0.5;

/// Taylor series in x^2; what is left out is below 1e-17.
/// For |x| <= SHORT_ARC: both components of an arc, but for the last factor x of the second.
constexpr TwoSeries<7> SHORT_ARC_SERIES = {{{1.0 / 6227020800, 1.0 / 87178291200},
                                            {-1.0 / 39916800, -1.0 / 479001600},
                                            {1.0 / 362880, 1.0 / 3628800},
                                            {-1.0 / 5040, -1.0 / 40320},
                                            {1.0 / 120, 1.0 / 720},
                                            {-1.0 / 6, -1.0 / 24},
                                            {1.0, 1.0 / 2}}};

/// arc() beyond SHORT_ARC, from direction(): several times as expensive.
Arc long_arc(double angle);

/// The arc that turns by `angle` (rad): sin(angle) / angle, (1 - cos(angle)) / angle. Absolute
/// error below 1e-15 within one turn; for angle = 0 exactly (1, 0).
inline Arc arc(double angle) {
    if (std::abs(angle) > SHORT_ARC) [[unlikely]]
        return long_arc(angle);
    const Eigen::Array2d both = series(SHORT_ARC_SERIES, angle * angle);
    return {both[0], both[1] * angle};
}

/// `v` turned counter-clockwise, from the frame whose x axis is the unit vector `ahead` into the
/// one that `ahead` is given in.
inline Eigen::Vector2d turned(const Eigen::Vector2d &v, const Eigen::Vector2d &ahead) {
    return {ahead.x() * v.x() - ahead.y() * v.y(), ahead.y() * v.x() + ahead.x() * v.y()};
}

/// The same angle in [-pi, pi), rad. For angles of many turns the error grows with their number.
double wrapped(double angle);

}  // namespace kilotwin

#endif
