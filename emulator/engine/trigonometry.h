/// Sine and cosine by our own polynomials: the same bits with every compiler and C library.
#ifndef KILOTWIN_ENGINE_TRIGONOMETRY_H
#define KILOTWIN_ENGINE_TRIGONOMETRY_H

#include <Eigen/Core>

namespace kilotwin {

constexpr double PI = 3.14159265358979323846;

/// (cos, sin) of an angle in radians, |angle| <= 1e6. Absolute error below 1e-15 within one turn.
Eigen::Vector2d direction(double angle);

/// The same angle in [-pi, pi).
double wrapped(double angle);

}  // namespace kilotwin

#endif
