// The Box2D solver by itself: bounds that run ahead and the lists of neighbours rest on.
#include <doctest/doctest.h>

#include <vector>

#include "base/clock.h"
#include "physics/contact/box2d_solver.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_box2d_solver {

namespace {

constexpr double RADIUS = 0.1, SPEED = 0.1, FASTEST = 0.11;
constexpr int TICKS = 4;
constexpr auto BOTH = {Box2DSolver::Accuracy::NORMAL, Box2DSolver::Accuracy::ORACLE};

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

/// Distance of the rims of two robots that drive at each other for a tick, at `speed_m_s` each and
/// `gap_m` apart.
double gap_after_a_tick_m(double speed_m_s, double gap_m, Box2DSolver::Accuracy accuracy) {
    const Arena arena = square_hall(4);
    Box2DSolver solver(arena, {RADIUS, 1, 1, speed_m_s, 1.1 * speed_m_s}, 2, {}, accuracy);
    const Shift velocity{{speed_m_s, 0}, 0}, back{{-speed_m_s, 0}, 0};
    std::vector<DrivenBody> driven = {{velocity, velocity}, {back, back}};
    std::vector<Shift> moved(2);
    const Shift there{velocity.by * TICK_S, 0}, here{back.by * TICK_S, 0};
    const Pose left{{0, 0}, 0}, right{{2 * RADIUS + gap_m, 0}, PI};
    Islands islands;
    islands.bodies.push_back({0, false, false, left, there, driven[0], moved[0]});
    islands.bodies.push_back({1, false, false, right, here, driven[1], moved[1]});
    islands.pairs = {{0, 1}};
    solver.solve(islands, TICK_S);
    return gap_m + moved[1].by.x() - moved[0].by.x();
}

}  // namespace

TEST_CASE("Box2D moves no robot faster than the bound, however fast it is pushed") {
    for (const auto accuracy : BOTH)
        for (const double length_m : moved_m(3 * FASTEST, accuracy)) {
            CHECK(length_m <= FASTEST * TICKS * TICK_S * (1 + 1e-5));
            CHECK(length_m > 0.9 * FASTEST * TICKS * TICK_S);
        }
}

TEST_CASE("Box2D leaves robots below the bound as fast as they are") {
    for (const double length_m : moved_m(SPEED, Box2DSolver::Accuracy::NORMAL))
        CHECK(length_m == doctest::Approx(SPEED * TICKS * TICK_S).epsilon(1e-5));
}

TEST_CASE("Box2D lets no robots into each other that close by more in a tick than it looks ahead") {
    // It looks ahead by a fifth of a radius.
    const double gap_m = 0.3 * RADIUS;
    for (const auto accuracy : BOTH)
        CHECK(gap_after_a_tick_m(gap_m / TICK_S, gap_m, accuracy) > -0.01 * RADIUS);
}

TEST_CASE("no part of an object that Box2D turns is faster than the bound") {
    const double radius_m = 0.5;
    const Object plate({{{{0, 0}, radius_m, {}}}, {}, 1, 0, 0, 0.3});
    const Arena arena = square_hall(4);
    for (const auto accuracy : BOTH) {
        Box2DSolver solver(arena, {RADIUS, 1, 1, SPEED, FASTEST}, 0, {plate}, accuracy);
        ObjectState state{{}, {{0, 0}, 3 * FASTEST / radius_m}};
        Islands islands;
        islands.objects.push_back({0, state});
        solver.solve(islands, TICK_S);
        CHECK(state.velocity.turn > 0);
        CHECK(state.velocity.turn * radius_m <= FASTEST * (1 + 1e-5));
    }
}

}  // namespace test_box2d_solver
