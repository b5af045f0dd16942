// The solvers of islands by themselves: bounds that run ahead and the lists of neighbours rest on.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "physics/contact/box2d_solver.h"
#include "physics/contact/disc_solver.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_box2d_solver {

namespace {

constexpr double RADIUS = 0.1, SPEED = 0.1, FASTEST = 0.11;
constexpr int TICKS = 4;
constexpr auto BOTH = {Box2DSolver::Accuracy::NORMAL, Box2DSolver::Accuracy::ORACLE};

enum class Kind : uint8_t { DISCS, BOX2D, ORACLE };
constexpr auto ALL = {Kind::DISCS, Kind::BOX2D, Kind::ORACLE};

std::unique_ptr<IslandSolver> solver_of(Kind kind, const Arena &arena, const Mechanics &mechanics,
                                        size_t robots) {
    using Accuracy = Box2DSolver::Accuracy;
    static Team alone;
    if (kind == Kind::DISCS) return std::make_unique<DiscSolver>(arena, mechanics, alone);
    const auto accuracy = kind == Kind::ORACLE ? Accuracy::ORACLE : Accuracy::NORMAL;
    return std::make_unique<Box2DSolver>(arena, mechanics, robots, std::vector<Object>{}, accuracy);
}

/// Distances that four robots go in a step, each with the velocity that it is given: three in a
/// row that touch, and one that touches none of them.
std::vector<double> moved_m(double velocity_m_s, Kind kind) {
    const Arena arena = square_hall(4);
    const auto solver = solver_of(kind, arena, {RADIUS, 1, 1, SPEED, FASTEST}, 4);
    const Shift velocity{{velocity_m_s, 0}, 0};
    std::vector<DrivenBody> driven(4, {velocity, velocity});
    std::vector<Shift> moved(4);
    const Shift free{velocity.by * (TICKS * TICK_S), 0};
    const std::vector<Pose> poses = {{{0, 0}, 0}, {{0.2, 0}, 0}, {{0.4, 0}, 0}, {{0, 1}, 0}};
    std::vector<Islands> shares(1);
    Islands &islands = shares[0];
    for (uint32_t i = 0; i < 4; i++)
        islands.bodies.push_back({i, false, false, poses[i], free, driven[i], moved[i]});
    islands.pairs = {{0, 1}, {1, 2}};
    solver->solve(shares, TICKS * TICK_S);
    std::vector<double> lengths;
    for (const auto &shift : moved) lengths.push_back(shift.by.norm());
    return lengths;
}

/// Distance of the rims of two robots that drive at each other for a tick, at `speed_m_s` each and
/// `gap_m` apart.
double gap_after_a_tick_m(double speed_m_s, double gap_m, Kind kind) {
    const Arena arena = square_hall(4);
    const auto solver = solver_of(kind, arena, {RADIUS, 1, 1, speed_m_s, 1.1 * speed_m_s}, 2);
    const Shift velocity{{speed_m_s, 0}, 0}, back{{-speed_m_s, 0}, 0};
    std::vector<DrivenBody> driven = {{velocity, velocity}, {back, back}};
    std::vector<Shift> moved(2);
    const Shift there{velocity.by * TICK_S, 0}, here{back.by * TICK_S, 0};
    const Pose left{{0, 0}, 0}, right{{2 * RADIUS + gap_m, 0}, PI};
    std::vector<Islands> shares(1);
    Islands &islands = shares[0];
    islands.bodies.push_back({0, false, false, left, there, driven[0], moved[0]});
    islands.bodies.push_back({1, false, false, right, here, driven[1], moved[1]});
    islands.pairs = {{0, 1}};
    solver->solve(shares, TICK_S);
    return gap_m + moved[1].by.x() - moved[0].by.x();
}

struct Row {
    std::vector<Pose> poses;
};

/// Four robots in a row along a wall, or far from it, after three seconds in which the first one
/// drives at the others and a little into the wall. The solver forgets `forgets` in the middle.
Row pushed_row(Kind kind, bool at_wall, std::optional<uint32_t> forgets = {}) {
    Arena arena;
    arena.bounds = {Region::Shape::RECTANGLE, {0, 0}, {4, at_wall ? 2 * RADIUS : 4}};
    const auto solver = solver_of(kind, arena, {RADIUS, 1, 1, SPEED, FASTEST}, 4);
    Row row;
    for (uint32_t i = 0; i < 4; i++) row.poses.push_back({{2 * RADIUS * i, 0}, 0});
    const Shift ahead{{SPEED, at_wall ? 0.1 * SPEED : 0}, 0};
    std::vector<DrivenBody> driven(4);
    driven[0] = {ahead, ahead};
    constexpr int STEPS = 23;
    for (int step = 0; step < STEPS; step++) {
        std::vector<Shift> moved(4), free(4);
        free[0].by = ahead.by * (TICKS * TICK_S);
        std::vector<Islands> shares(1);
        Islands &islands = shares[0];
        for (uint32_t i = 0; i < 4; i++)
            islands.bodies.push_back(
                {i, false, at_wall, row.poses[i], free[i], driven[i], moved[i]});
        islands.pairs = {{0, 1}, {1, 2}, {2, 3}};
        solver->solve(shares, TICKS * TICK_S);
        if (forgets && step == STEPS / 2) solver->forget(*forgets);
        for (uint32_t i = 0; i < 4; i++) {
            row.poses[i].position += moved[i].by;
            row.poses[i].heading += moved[i].turn;
        }
    }
    return row;
}

}  // namespace

TEST_CASE("no solver moves a robot faster than the bound, however fast it is pushed") {
    for (const Kind kind : ALL)
        for (const double length_m : moved_m(3 * FASTEST, kind)) {
            CHECK(length_m <= FASTEST * TICKS * TICK_S * (1 + 1e-5));
            CHECK(length_m > 0.9 * FASTEST * TICKS * TICK_S);
        }
}

TEST_CASE("solvers leave robots below the bound as fast as they are") {
    for (const Kind kind : {Kind::DISCS, Kind::BOX2D})
        for (const double length_m : moved_m(SPEED, kind))
            CHECK(length_m == doctest::Approx(SPEED * TICKS * TICK_S).epsilon(1e-5));
}

TEST_CASE(
    "no solver lets robots into each other that close by more in a tick than it looks ahead") {
    // Box2D looks ahead by a fifth of a radius.
    const double gap_m = 0.3 * RADIUS;
    for (const Kind kind : ALL)
        CHECK(gap_after_a_tick_m(gap_m / TICK_S, gap_m, kind) > -0.01 * RADIUS);
}

TEST_CASE("a row of discs that one drives into goes as in Box2D, also beside a wall") {
    for (const bool at_wall : {false, true}) {
        const Row discs = pushed_row(Kind::DISCS, at_wall);
        const Row box2d = pushed_row(Kind::BOX2D, at_wall);
        const Row oracle = pushed_row(Kind::ORACLE, at_wall);
        double pushed_m = 0;
        for (size_t i = 0; i < discs.poses.size(); i++) {
            const Eigen::Vector2d &place = discs.poses[i].position;
            CHECK((place - box2d.poses[i].position).norm() < 0.01 * RADIUS);
            CHECK((place - oracle.poses[i].position).norm() < 0.1 * RADIUS);
            pushed_m = std::max(pushed_m, place.x() - static_cast<double>(i) * 2 * RADIUS);
        }
        CHECK(pushed_m > 0.1 * RADIUS);
    }
}

TEST_CASE("a solver of discs starts a robot anew that it was told to forget") {
    const Row gone_on = pushed_row(Kind::DISCS, false),
              forgotten = pushed_row(Kind::DISCS, false, 1);
    const auto again = pushed_row(Kind::DISCS, false);
    CHECK(gone_on.poses.back().position == again.poses.back().position);
    CHECK(gone_on.poses.back().position != forgotten.poses.back().position);
}

TEST_CASE("no part of an object that Box2D turns is faster than the bound") {
    const double radius_m = 0.5;
    const Object plate({{{{0, 0}, radius_m, {}}}, {}, 1, 0, 0, 0.3});
    const Arena arena = square_hall(4);
    for (const auto accuracy : BOTH) {
        Box2DSolver solver(arena, {RADIUS, 1, 1, SPEED, FASTEST}, 0, {plate}, accuracy);
        ObjectState state{{}, {{0, 0}, 3 * FASTEST / radius_m}};
        std::vector<Islands> shares(1);
        Islands &islands = shares[0];
        islands.objects.push_back({0, state});
        solver.solve(shares, TICK_S);
        CHECK(state.velocity.turn > 0);
        CHECK(state.velocity.turn * radius_m <= FASTEST * (1 + 1e-5));
    }
}

}  // namespace test_box2d_solver
