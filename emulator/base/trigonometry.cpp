#include "base/trigonometry.h"

#include <cmath>
#include <cstdint>

namespace kilotwin {

namespace {

// Taylor series in x^2; what is left out is below 1e-17.
// For |x| <= pi/4: sin(x) / x - 1 and cos(x) - 1, but for the last factor x^2.
constexpr TwoSeries<8> SINE_COSINE = {{{1.0 / 355687428096000, 1.0 / 20922789888000},
                                       {-1.0 / 1307674368000, -1.0 / 87178291200},
                                       {1.0 / 6227020800, 1.0 / 479001600},
                                       {-1.0 / 39916800, -1.0 / 3628800},
                                       {1.0 / 362880, 1.0 / 40320},
                                       {-1.0 / 5040, -1.0 / 720},
                                       {1.0 / 120, 1.0 / 24},
                                       {-1.0 / 6, -1.0 / 2}}};
// Cosine and sine of an angle in each quarter, from those of what is left of it in the first.
constexpr double OF_COSINE[][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
constexpr double OF_SINE[][2] = {{0, 1}, {-1, 0}, {0, -1}, {1, 0}};

/// floor() of |value| < 2^51, without a call or a branch: next to 1.5 * 2^52, doubles are the whole
/// numbers.
double whole_below(double value) {
    constexpr double TO_WHOLE = 0x1.8p52;
    const double nearest = (value + TO_WHOLE) - TO_WHOLE;
    return (nearest - 0.5) + std::copysign(0.5, value - nearest);
}

}  // namespace

Eigen::Vector2d direction(double angle) {
    // pi/2 in two parts, so that the reduction is exact to the last bits.
    constexpr double HALF_PI_HIGH = 1.5707963267948966, HALF_PI_LOW = 6.123233995736766e-17;
    const double quarters = whole_below(angle * (1 / HALF_PI_HIGH) + 0.5);
    double x = (angle - quarters * HALF_PI_HIGH) - quarters * HALF_PI_LOW;
    const double square = x * x;
    const Eigen::Array2d shares = series(SINE_COSINE, square) * square;
    const double s = x + x * shares[0], c = 1 + shares[1];
    // Tables in place of branches, which could not be predicted.
    const auto quarter = static_cast<uint64_t>(static_cast<int64_t>(quarters)) % 4;
    using Pair = Eigen::Map<const Eigen::Array2d>;
    return c * Pair(OF_COSINE[quarter]) + s * Pair(OF_SINE[quarter]);
}

Arc long_arc(double angle) {
    const Eigen::Vector2d end = direction(angle);
    return {end.y() / angle, (1 - end.x()) / angle};
}

double wrapped(double angle) {
    if (std::abs(angle) < 3) return angle;
    double within = angle - 2 * PI * whole_below((angle + PI) / (2 * PI));
    if (within < -PI) within += 2 * PI;  // rounding may leave it a hair outside
    return within < PI ? within : within - 2 * PI;
}

}  // namespace kilotwin
