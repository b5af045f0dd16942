#include "engine/motion.h"

#include <doctest/doctest.h>

#include <cmath>

#include "engine/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

TEST_CASE("both motors drive straight, as fast as the weaker one allows") {
    Profile robot = foot_bot();
    robot.straight_left = 60;
    robot.straight_right = 80;
    CHECK(robot.drive(60, 80) == Drive{0.10, 0});
    CHECK(robot.drive(30, 80) == Drive{0.05, 0});
    CHECK(robot.drive(60, 20) == Drive{0.025, 0});
    CHECK(robot.drive(255, 255) == Drive{0.10, 0});
}

TEST_CASE("one motor turns on the spot: the left one counter-clockwise") {
    CHECK(foot_bot().drive(65, 0) == Drive{0, 1.43});
    CHECK(foot_bot().drive(0, 65) == Drive{0, -1.43});
    CHECK(foot_bot().drive(1, 0) == Drive{0, 1.43});
    CHECK(foot_bot().drive(0, 0).at_rest());
}

TEST_CASE("a robot drives along its heading in closed form") {
    Trajectory way(ticks(5), {{1, 2}, 0.6});
    way.change(ticks(5), {0.1, 0});
    double s = seconds(ticks(1000));
    Pose pose = way.pose(ticks(1005));
    CHECK(pose.position.x() == doctest::Approx(1 + 0.1 * s * std::cos(0.6)).epsilon(1e-14));
    CHECK(pose.position.y() == doctest::Approx(2 + 0.1 * s * std::sin(0.6)).epsilon(1e-14));
    CHECK(pose.heading == 0.6);
    CHECK(way.position(ticks(1005)) == pose.position);
}

TEST_CASE("a robot turns on the spot in closed form, over many turns") {
    Trajectory way(0, {{1, 2}, 0.5});
    way.change(0, {0, 1.43});
    double s = seconds(ticks(10'000));
    Pose pose = way.pose(ticks(10'000));
    CHECK(pose.position == Eigen::Vector2d(1, 2));
    CHECK(std::abs(std::remainder(pose.heading - (0.5 + 1.43 * s), 2 * PI)) < 1e-11);
    CHECK(std::abs(pose.heading) <= PI);
    CHECK((way.ahead(ticks(10'000)) - direction(pose.heading)).norm() < 1e-15);
}

TEST_CASE("a change of motion keeps the pose of that moment") {
    Trajectory way(0, {{0, 0}, 0});
    way.change(0, {0.1, 0});
    way.change(CYCLES_PER_SECOND * 2, {0, 1});  // 0.2 m along x, then a quarter turn
    way.change(static_cast<Cycles>(CYCLES_PER_SECOND * (2 + PI / 2)), {0.1, 0});
    Pose pose = way.pose(static_cast<Cycles>(CYCLES_PER_SECOND * (3 + PI / 2)));
    CHECK((pose.position - Eigen::Vector2d(0.2, 0.1)).norm() < 1e-7);
    CHECK(std::abs(pose.heading - PI / 2) < 1e-6);
    way.change(CYCLES_PER_SECOND * 10, {});
    CHECK(way.position(CYCLES_PER_SECOND * 10) == way.position(CYCLES_PER_SECOND * 99));
}

TEST_CASE("where a robot is does not depend on how often one asks") {
    Trajectory asked(0, {{0.3, -0.2}, 2.5}), not_asked = asked;
    asked.change(0, {0.07, 0});
    not_asked.change(0, {0.07, 0});
    for (uint64_t i = 1; i < 100; i++) (void)asked.pose(ticks(i));
    CHECK(asked.position(ticks(777)) == not_asked.position(ticks(777)));
}
