/// Sine and cosine by our own polynomials: the same bits with every compiler and C library.
#ifndef KILOTWIN_ENGINE_TRIGONOMETRY_H
#define KILOTWIN_ENGINE_TRIGONOMETRY_H

#include <Eigen/Core>

namespace kilotwin {

constexpr double PI = 3.14159265358979323846;

/// (cos, sin) of an angle in radians, |angle| <= 1e6. Absolute error below 1e-15 within one turn.
Eigen::Vector2d direction(double angle);

/// Where one gets on a path of length 1 that turns by `angle` (rad) on the way, in the frame of its
/// begin: sin(angle) / angle straight on, (1 - cos(angle)) / angle to the left. Absolute error below
/// 1e-15 within one turn; for angle = 0 exactly (1, 0).
Eigen::Vector2d arc(double angle);

/// The same angle in [-pi, pi).
double wrapped(double angle);

}  // namespace kilotwin

#endif
