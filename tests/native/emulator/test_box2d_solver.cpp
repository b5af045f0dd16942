// The Box2D solver by itself: the bound that run ahead and the lists of neighbours rest on.
#include <doctest/doctest.h>

#include <vector>

#include "base/clock.h"
#include "physics/contact/box2d_solver.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace {

constexpr double RADIUS = 0.1, SPEED = 0.1, FASTEST = 0.11;
constexpr int TICKS = 4;

/// Distances that four robots go in a step, each with the velocity that it is given: three in a
/// row that touch, and one that touches none of them.
std::vector<double> moved_m(double velocity_m_s, Box2DSolver::Accuracy accuracy) {
    const Arena arena = square_hall(4);
    Box2DSolver solver(arena, {RADIUS, 1, 1, SPEED, FASTEST}, 4, {}, accuracy);
    const Shift velocity{{velocity_m_s, 0}, 0};
    std::vector<DrivenBody> driven(4, {velocity, velocity});
    std::vector<Shift> moved(4);
    const Shift free{velocity.by * (TICKS * TICK_S), 0};
    const std::vector<Pose> poses = {{{0, 0}, 0}, {{0.2, 0}, 0}, {{0.4, 0}, 0}, {{0, 1}, 0}};
    Islands islands;
    for (uint32_t i = 0; i < 4; i++)
        islands.bodies.push_back({i, false, false, poses[i], free, driven[i], moved[i]});
    islands.pairs = {{0, 1}, {1, 2}};
    solver.solve(islands, TICKS * TICK_S);
    std::vector<double> lengths;
    for (const auto &shift : moved) lengths.push_back(shift.by.norm());
    return lengths;
}

}  // namespace

TEST_CASE("Box2D moves no robot faster than the bound, however fast it is pushed") {
    for (const auto accuracy : {Box2DSolver::Accuracy::NORMAL, Box2DSolver::Accuracy::ORACLE})
        for (const double length_m : moved_m(3 * FASTEST, accuracy)) {
            CHECK(length_m <= FASTEST * TICKS * TICK_S * (1 + 1e-5));
            CHECK(length_m > 0.9 * FASTEST * TICKS * TICK_S);
        }
}

TEST_CASE("Box2D leaves robots below the bound as fast as they are") {
    for (const double length_m : moved_m(SPEED, Box2DSolver::Accuracy::NORMAL))
        CHECK(length_m == doctest::Approx(SPEED * TICKS * TICK_S).epsilon(1e-5));
}
