// The law of a drive (physics/contact/mechanics.h) by numbers.
#include <doctest/doctest.h>

#include "physics/contact/mechanics.h"

using namespace kilotwin;

namespace test_mechanics {

namespace {

constexpr Mechanics::Change FORCE = {0.01, 0.5};

Shift shift(double x, double y, double turn) { return {{x, y}, turn}; }

/// Velocity of a robot that had `velocity` and wanted `before`, driven towards `now`.
Shift driven(const Shift &velocity, const Shift &before, const Shift &now) {
    DrivenBody body{velocity, before};
    body.drive(now, FORCE);
    CHECK(body.wanted.by == now.by);
    CHECK(body.wanted.turn == now.turn);
    return body.velocity;
}

}  // namespace

TEST_CASE("a robot that nothing holds takes the velocity that its program wants, at once") {
    for (const auto &now :
         {shift(0, 0, 0), shift(-0.1, 0, -2), shift(0, 0.1, 2), shift(0.1, 0, 2)}) {
        const Shift moving = shift(0.1, 0, 2);
        const Shift velocity = driven(moving, moving, now);
        CHECK(velocity.by.x() == doctest::Approx(now.by.x()));
        CHECK(velocity.by.y() == doctest::Approx(now.by.y()));
        CHECK(velocity.turn == doctest::Approx(now.turn));
    }
}

TEST_CASE(
    "the force of a drive brings a robot that was held nearer to what it wants, and no more") {
    const Shift wanted = shift(0.03, 0.04, -2);
    const Shift velocity = driven(shift(0, 0, 0), wanted, wanted);
    CHECK(velocity.by.x() == doctest::Approx(0.006));
    CHECK(velocity.by.y() == doctest::Approx(0.008));
    CHECK(velocity.turn == doctest::Approx(-0.5));
    const Shift near = driven(shift(0.025, 0.04, -1.75), wanted, wanted);
    CHECK(near.by.x() == doctest::Approx(0.03));
    CHECK(near.turn == doctest::Approx(-2));
}

TEST_CASE("a held robot whose program turns it round gains the change and the force of its drive") {
    const Shift before = shift(0.1, 0, 1), now = shift(-0.1, 0, -1);
    const Shift velocity = driven(shift(0.2, 0, 4), before, now);
    CHECK(velocity.by.x() == doctest::Approx(0.2 - 0.2 - 0.01));
    CHECK(velocity.turn == doctest::Approx(4 - 2 - 0.5));
}

TEST_CASE("a solver of long steps is told of changes of what is wanted, and of nothing else") {
    const Shift wanted = shift(0.1, 0, 1);
    DrivenBody body{shift(0, 0, 0), wanted};
    CHECK(!body.change_wanted(wanted));
    CHECK(body.velocity.by.isZero(0));
    CHECK(body.change_wanted(shift(0.1, 0, 1.5)));
    CHECK(body.velocity.turn == doctest::Approx(0.5));
    CHECK(body.velocity.by.isZero(0));
    CHECK(body.change_wanted(shift(0.1, 0.02, 1.5)));
    CHECK(body.velocity.by.norm() == doctest::Approx(0.02));
    CHECK(body.velocity.turn == doctest::Approx(0.5));
}

TEST_CASE("a drive's rate is its force over what is missing, up to a bound") {
    const Mechanics mechanics = {0.02, 1, 0.5, 1, 1};
    const double most_per_s = 32;
    // What is missing is 0.1 m/s and 10 rad/s; the force makes 0.5 m/s2, or 50 rad/s2 at the rim.
    const DrivenBody held{shift(0, 0, 0), shift(0.06, 0.08, -10)};
    CHECK(held.rates(mechanics, most_per_s).by_per_s == doctest::Approx(5));
    CHECK(held.rates(mechanics, most_per_s).turn_per_s == doctest::Approx(5));
    const DrivenBody free{shift(0.06, 0.079, -9), shift(0.06, 0.08, -10)};
    CHECK(free.rates(mechanics, most_per_s).by_per_s == most_per_s);
    CHECK(free.rates(mechanics, most_per_s).turn_per_s == most_per_s);
}

}  // namespace test_mechanics
