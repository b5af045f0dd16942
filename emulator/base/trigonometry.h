/// Sine and cosine by polynomials of our own: the same bits with every compiler and C library, as
/// "same seed, same result" needs.
#ifndef KILOTWIN_BASE_TRIGONOMETRY_H
#define KILOTWIN_BASE_TRIGONOMETRY_H

#include <Eigen/Core>

namespace kilotwin {

/// To the nearest double.
constexpr double PI = 3.14159265358979323846;

/// (cos, sin) of an angle in radians, |angle| <= 1e6. Absolute error below 1e-15 within one turn.
Eigen::Vector2d direction(double angle);

/// Where a path of length 1 that turns on the way ends, in the frame of its begin.
struct Arc {
    double straight, aside;  ///< ahead, and to the left
};

/// The arc that turns by `angle` (rad): sin(angle) / angle, (1 - cos(angle)) / angle. Absolute
/// error below 1e-15 within one turn; for angle = 0 exactly (1, 0).
Arc arc(double angle);

/// The same angle in [-pi, pi), rad. For angles of many turns the error grows with their number.
double wrapped(double angle);

}  // namespace kilotwin

#endif
