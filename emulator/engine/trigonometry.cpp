#include "engine/trigonometry.h"

#include <cmath>
#include <cstdint>

namespace kilotwin {

namespace {

// Taylor series in x^2 for |x| <= pi/4, highest power first; what is left out is below 1e-17.
constexpr double SINE[] = {
    1.0 / 355687428096000, -1.0 / 1307674368000, 1.0 / 6227020800, -1.0 / 39916800,
    1.0 / 362880,          -1.0 / 5040,          1.0 / 120,        -1.0 / 6};
constexpr double COSINE[] = {
    1.0 / 20922789888000, -1.0 / 87178291200, 1.0 / 479001600, -1.0 / 3628800,
    1.0 / 40320,          -1.0 / 720,         1.0 / 24,        -1.0 / 2};

// The same series, divided by x, for |x| <= 1/2: sin(x) / x and (1 - cos(x)) / x^2.
constexpr double SMALL = 0.5;
constexpr double STRAIGHT[] = {
    1.0 / 6227020800, -1.0 / 39916800, 1.0 / 362880, -1.0 / 5040, 1.0 / 120, -1.0 / 6, 1};
constexpr double ASIDE[] = {1.0 / 87178291200, -1.0 / 479001600, 1.0 / 3628800, -1.0 / 40320,
                            1.0 / 720,         -1.0 / 24,        1.0 / 2};

/// floor() of what fits 64 bits, without a call.
double whole_below(double value) {
    const auto whole = static_cast<int64_t>(value);
    return static_cast<double>(whole - (static_cast<double>(whole) > value));
}

double horner(const double (&coefficients)[8], double square) {
    double value = coefficients[0];
    for (int i = 1; i < 8; i++) value = value * square + coefficients[i];
    return value * square;
}

}  // namespace

Eigen::Vector2d direction(double angle) {
    // pi/2 in two parts, so that the reduction is exact to the last bits.
    constexpr double HALF_PI_HIGH = 1.5707963267948966, HALF_PI_LOW = 6.123233995736766e-17;
    double quarters = whole_below(angle / HALF_PI_HIGH + 0.5);
    double x = (angle - quarters * HALF_PI_HIGH) - quarters * HALF_PI_LOW;
    double s = x + x * horner(SINE, x * x);
    double c = 1 + horner(COSINE, x * x);
    // Who turns on a quarter swaps them, and changes the sign of one: no branch, since nobody could
    // foresee it.
    const auto quarter = static_cast<int64_t>(quarters);
    const double both[] = {c, s};
    auto sign = [](int64_t bits) { return static_cast<double>(1 - (bits & 2)); };
    return {sign(quarter + 1) * both[quarter & 1], sign(quarter) * both[~quarter & 1]};
}

Eigen::Vector2d arc(double angle) {
    if (std::abs(angle) > SMALL) {
        const Eigen::Vector2d end = direction(angle);
        return {end.y() / angle, (1 - end.x()) / angle};
    }
    const double square = angle * angle;
    double straight = STRAIGHT[0], aside = ASIDE[0];
    for (int i = 1; i < 7; i++) {
        straight = straight * square + STRAIGHT[i];
        aside = aside * square + ASIDE[i];
    }
    return {straight, aside * angle};
}

double wrapped(double angle) {
    if (std::abs(angle) < 3) return angle;
    double within = angle - 2 * PI * whole_below((angle + PI) / (2 * PI));
    if (within < -PI) within += 2 * PI;  // rounding may leave it a hair outside
    return within < PI ? within : within - 2 * PI;
}

}  // namespace kilotwin
