#include "base/trigonometry.h"

#include <doctest/doctest.h>

#include <cmath>

#include "support.h"

using namespace kilotwin;
using kilotwin::testing::Dice;

namespace test_trigonometry {

namespace {

/// Largest difference from libm, in long double, over random angles up to `most`.
double worst_error(double most) {
    Dice dice(1);
    double worst = 0;
    for (int i = 0; i < 200'000; i++) {
        double angle = dice.between(-most, most);
        Eigen::Vector2d got = direction(angle);
        auto exact = static_cast<long double>(angle);
        worst = std::max(worst, static_cast<double>(std::abs(got.x() - std::cos(exact))));
        worst = std::max(worst, static_cast<double>(std::abs(got.y() - std::sin(exact))));
    }
    return worst;
}

}  // namespace

TEST_CASE("sine and cosine agree with libm to 1e-15 within one turn") {
    CHECK(worst_error(2 * PI) < 1e-15);
}

TEST_CASE("sine and cosine stay good far out") { CHECK(worst_error(1e6) < 1e-10); }

TEST_CASE("sine and cosine are exact on the axes") {
    CHECK(direction(0) == Eigen::Vector2d(1, 0));
    for (int quarter = -4; quarter <= 4; quarter++) {
        Eigen::Vector2d got = direction(quarter * PI / 2);
        CHECK(got.cwiseAbs().maxCoeff() == 1);
        CHECK(got.cwiseAbs().minCoeff() < 1e-15);
    }
}

TEST_CASE("a direction is a unit vector, to the last bits") {
    Dice dice(2);
    for (int i = 0; i < 10'000; i++)
        CHECK(std::abs(direction(dice.between(-10, 10)).squaredNorm() - 1) < 1e-15);
}

TEST_CASE("an arc ends where libm has it, to 1e-15 within one turn") {
    Dice dice(4);
    for (int i = 0; i < 100'000; i++) {
        const double most = i % 2 ? 2 * PI : 0.6, angle = dice.between(-most, most);
        const auto exact = static_cast<long double>(angle);
        const auto [straight, aside] = arc(angle);
        CHECK(std::abs(straight - std::sin(exact) / exact) < 1e-15);
        CHECK(std::abs(aside - 2 * std::pow(std::sin(exact / 2), 2) / exact) < 1e-15);
    }
    CHECK(arc(0).straight == 1);
    CHECK(arc(0).aside == 0);
}

TEST_CASE("a wrapped angle lies in [-pi, pi) and is the same angle") {
    Dice dice(3);
    for (int i = 0; i < 100'000; i++) {
        double angle = dice.between(-20, 20), got = wrapped(angle);
        CHECK(got >= -PI);
        CHECK(got < PI);
        CHECK(std::abs(std::remainder(got - angle, 2 * PI)) < 1e-14);
    }
}

TEST_CASE("angles on the edge wrap into [-pi, pi)") {
    for (int turn = -5; turn <= 5; turn++)
        for (double edge : {-PI, PI})
            for (int ulps = -3; ulps <= 3; ulps++) {
                double angle = edge + 2 * PI * turn;
                for (int i = 0; i < std::abs(ulps); i++)
                    angle = std::nextafter(angle, ulps * 100.0);
                CAPTURE(angle);
                CHECK(wrapped(angle) >= -PI);
                CHECK(wrapped(angle) < PI);
            }
}

TEST_CASE("wrapping leaves an angle in range alone") {
    for (double angle : {-PI, -1.0, 0.0, 1e-300, 0.5, 3.14}) CHECK(wrapped(angle) == angle);
}

}  // namespace test_trigonometry
