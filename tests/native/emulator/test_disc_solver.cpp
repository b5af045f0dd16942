// The disc solver by itself: what discs in islands must do, whatever computes it.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "base/clock.h"
#include "physics/contact/disc_solver.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_disc_solver {

namespace {

constexpr double RADIUS = 0.1, DIAMETER = 0.2, SPEED = 0.1, FASTEST = 0.11;

/// Robots that are solved together, each with what it wants.
struct Discs {
    struct Robot {
        Pose pose;
        Shift wanted;
        bool fixed = false;
        DrivenBody driven = {wanted, wanted};
    };
    Arena arena = square_hall(4);
    double push_m_s2 = 1;
    std::vector<Robot> robots;
    std::vector<Shift> moved = {};
    DiscSolver solver = {arena, {RADIUS, 1, push_m_s2, SPEED, FASTEST}};

    Discs(std::vector<Robot> of, double push = 1) : push_m_s2(push), robots(std::move(of)) {}

    void step(int ticks) {
        const double step_s = ticks * TICK_S;
        std::vector<Shift> free;
        for (auto &robot : robots)
            free.push_back({robot.wanted.by * step_s, robot.wanted.turn * step_s});
        moved.assign(robots.size(), {});
        Islands islands;
        for (uint32_t i = 0; i < robots.size(); i++) {
            islands.bodies.push_back({10 + i, robots[i].fixed, true, robots[i].pose, free[i],
                                      robots[i].driven, moved[i]});
            for (uint32_t j = i + 1; j < robots.size(); j++) islands.pairs.push_back({i, j});
        }
        solver.solve(islands, step_s);
        for (size_t i = 0; i < robots.size(); i++) {
            robots[i].pose.position += moved[i].by;
            robots[i].pose.heading += moved[i].turn;
        }
    }

    double gap(size_t a, size_t b) const {
        return (robots[a].pose.position - robots[b].pose.position).norm() - DIAMETER;
    }
    Eigen::Vector2d momentum() const {
        Eigen::Vector2d sum(0, 0);
        for (const auto &robot : robots) sum += robot.driven.velocity.by;
        return sum;
    }
    /// About the arena's centre; a disc's inertia is m r^2 / 2.
    double spin() const {
        double sum = 0;
        for (const auto &[pose, wanted, fixed, driven] : robots)
            sum += pose.position.x() * driven.velocity.by.y() -
                   pose.position.y() * driven.velocity.by.x() +
                   RADIUS * RADIUS / 2 * driven.velocity.turn;
        return sum;
    }
};

Discs::Robot at(double x, double y, const Eigen::Vector2d &velocity = {0, 0}, double turn = 0) {
    return {{{x, y}, 0}, {velocity, turn}};
}

}  // namespace

TEST_CASE("in an island, two that drive head-on stop where they touch") {
    Discs discs({at(-0.15, 0, {SPEED, 0}), at(0.15, 0, {-SPEED, 0})});
    for (int step = 0; step < 40; step++) discs.step(2);
    CHECK(std::abs(discs.gap(0, 1)) < 0.001 * DIAMETER);
    CHECK(std::abs(discs.robots[0].pose.position.x() + RADIUS) < 0.001 * DIAMETER);
    CHECK(discs.robots[0].driven.velocity.by.norm() < 0.01 * SPEED);
}

TEST_CASE("a robot that two press from both sides stays where it is") {
    Discs discs({at(-DIAMETER, 0, {SPEED, 0}), at(0, 0), at(DIAMETER, 0, {-SPEED, 0})});
    for (int step = 0; step < 60; step++) discs.step(4);
    CHECK(discs.robots[1].pose.position.norm() < 0.001 * DIAMETER);
    CHECK(discs.gap(0, 1) > -0.01 * DIAMETER);
    CHECK(discs.gap(1, 2) > -0.01 * DIAMETER);
}

TEST_CASE("discs without a drive keep their momentum, also that of turning, when they meet") {
    Discs discs(
        {at(-0.2, 0.02, {SPEED, 0}, 1), at(0.01, 0, {0, 0}), at(0.15, 0.16, {-0.05, -0.05})}, 0);
    for (auto &robot : discs.robots) robot.driven.wanted = robot.wanted;
    const Eigen::Vector2d momentum = discs.momentum();
    const double spin = discs.spin();
    double slowest_turn = 1;
    for (int step = 0; step < 30; step++) {
        discs.step(1);
        slowest_turn = std::min(slowest_turn, discs.robots[0].driven.velocity.turn);
    }
    CHECK(slowest_turn < 0.9);  // friction was there
    CHECK((discs.momentum() - momentum).norm() < 1e-12);
    // Impulses act where discs would touch, which is nearly where they do.
    CHECK(std::abs(discs.spin() - spin) < 0.02 * std::abs(spin));
}

TEST_CASE("two that overlap part within some ticks, and are no faster for it") {
    Discs discs({at(0, 0), at(0.15, 0)});
    double gap = discs.gap(0, 1);
    for (int step = 0; step < 30; step++) {
        discs.step(1);
        CHECK(discs.gap(0, 1) <= gap + 3 * SPEED * TICK_S + 1e-12);
        CHECK(discs.gap(0, 1) >= gap);
        gap = discs.gap(0, 1);
        for (const auto &robot : discs.robots) CHECK(robot.driven.velocity.by.norm() == 0);
    }
    CHECK(gap > -0.002 * DIAMETER);
    CHECK(gap <= 0);
}

TEST_CASE("all of many that overlap part") {
    Discs discs({at(0, 0), at(0.15, 0), at(0.075, 0.1), at(0.2, 0.1)});
    for (int step = 0; step < 100; step++) discs.step(4);
    for (size_t a = 0; a < 4; a++)
        for (size_t b = a + 1; b < 4; b++) CHECK(discs.gap(a, b) > -0.002 * DIAMETER);
}

TEST_CASE("two in one and the same place part") {
    Discs discs({at(0, 0), at(0, 0)});
    for (int step = 0; step < 100; step++) discs.step(1);
    CHECK(discs.gap(0, 1) > -0.002 * DIAMETER);
}

TEST_CASE("no robot is pushed faster than the bound, nor into a wall") {
    // Three that drive into the corner press a fourth into it.
    Discs discs({at(1.7, 1.7, {0.07, 0.07}), at(1.86, 1.86), at(1.5, 1.75, {SPEED, 0}),
                 at(1.75, 1.5, {0, SPEED})});
    for (int step = 0; step < 100; step++) {
        discs.step(4);
        for (size_t i = 0; i < discs.robots.size(); i++) {
            CHECK(discs.moved[i].by.norm() < 1.5 * FASTEST * 4 * TICK_S);
            CHECK(discs.robots[i].driven.velocity.by.norm() <= FASTEST * (1 + 1e-12));
            CHECK(2 - discs.robots[i].pose.position.maxCoeff() > 0.98 * RADIUS);
        }
    }
}

TEST_CASE("a firm robot is a wall to others") {
    Discs discs({at(0, 0), at(0.3, 0, {-SPEED, 0}), at(0, 0.3, {0, -SPEED})});
    discs.robots[0].fixed = true;
    for (int step = 0; step < 60; step++) {
        discs.step(2);
        CHECK(discs.moved[0].by == Eigen::Vector2d(0, 0));
    }
    CHECK(std::abs(discs.gap(0, 1)) < 0.002 * DIAMETER);
    CHECK(std::abs(discs.gap(0, 2)) < 0.002 * DIAMETER);
}

TEST_CASE("a robot without contact goes as it drives") {
    Discs discs({at(0, 0, {SPEED, 0}, 0.5), at(0, 0.3), at(0, -0.3, {0, -SPEED})});
    for (int step = 0; step < 10; step++) discs.step(2);
    const double time_s = 20 * TICK_S;
    CHECK(discs.robots[0].pose.position.x() == doctest::Approx(SPEED * time_s));
    CHECK(discs.robots[0].pose.heading == doctest::Approx(0.5 * time_s));
    CHECK(discs.robots[1].pose.position == Eigen::Vector2d(0, 0.3));
}

}  // namespace test_disc_solver
