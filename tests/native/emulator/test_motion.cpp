#include "physics/motion.h"

#include <doctest/doctest.h>

#include <cmath>

#include "base/trigonometry.h"
#include "physics/chassis.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_motion {

namespace {

const Chance LUCK(1);
const Slots ALONE(1);

Drive wheels(const Profile &profile, uint8_t left, uint8_t right) {
    return Chassis(profile, LUCK, ALONE).set_duties(0, 0, left, right);
}

Profile kilobot() {
    Profile profile = small_robot();
    profile.legs = true;
    return profile;
}

constexpr Cycles KICK = CYCLES_PER_SECOND * 15 / 1000;

}  // namespace

TEST_CASE("both wheels drive straight, as fast as the weaker motor allows") {
    Profile robot = foot_bot();
    robot.straight_left = 60;
    robot.straight_right = 80;
    CHECK(wheels(robot, 60, 80) == Drive{{0.10, 0}, 0});
    CHECK(wheels(robot, 30, 80) == Drive{{0.05, 0}, 0});
    CHECK(wheels(robot, 60, 20) == Drive{{0.025, 0}, 0});
    CHECK(wheels(robot, 255, 255) == Drive{{0.10, 0}, 0});
}

TEST_CASE("one wheel turns on the spot: the left motor counter-clockwise") {
    CHECK(wheels(foot_bot(), 65, 0) == Drive{{0, 0}, 1.43});
    CHECK(wheels(foot_bot(), 0, 65) == Drive{{0, 0}, -1.43});
    CHECK(wheels(foot_bot(), 1, 0) == Drive{{0, 0}, 1.43});
    CHECK(wheels(foot_bot(), 0, 0).at_rest());
}

TEST_CASE("legs start after a kick of 15 ms at full duty, and not without one") {
    for (bool kicked : {false, true}) {
        Chassis chassis(kilobot(), LUCK, ALONE);
        Cycles at = 1000;
        if (kicked) chassis.set_duties(0, at, 255, 255);
        Drive drive = chassis.set_duties(0, at + KICK, 65, 65);
        CHECK(drive.at_rest() == !kicked);
        if (kicked) CHECK((drive.velocity - Eigen::Vector2d(0.01, 0)).norm() < 1e-12);
        CHECK(chassis.set_duties(0, at + 2 * KICK, 0, 0).at_rest());
        CHECK(chassis.set_duties(0, at + 3 * KICK, 65, 65).at_rest());
    }
    Chassis hasty(kilobot(), LUCK, ALONE);
    hasty.set_duties(0, 0, 255, 255);
    CHECK(hasty.set_duties(0, KICK / 3, 65, 65).at_rest());
    Profile easy = kilobot();
    easy.kick_needed = false;
    CHECK_FALSE(Chassis(easy, LUCK, ALONE).set_duties(0, 0, 65, 65).at_rest());
}

TEST_CASE("a kick counts for each motor, though a chip writes one register after the other") {
    Chassis chassis(kilobot(), LUCK, ALONE);
    chassis.set_duties(0, 0, 255, 0);
    chassis.set_duties(0, 3, 255, 255);
    chassis.set_duties(0, KICK, 65, 255);
    const Drive drive = chassis.set_duties(0, KICK + 3, 65, 65);
    CHECK((drive.velocity - Eigen::Vector2d(0.01, 0)).norm() < 1e-12);
    CHECK(drive.turn == 0);
}

TEST_CASE("motors that are on and do not turn are summed up") {
    Chassis chassis(kilobot(), LUCK, ALONE);
    const Cycles second = CYCLES_PER_SECOND;
    chassis.set_duties(0, second, 65, 0);
    CHECK(chassis.hummed_s(0, 3 * second) == doctest::Approx(2));
    chassis.set_duties(0, 4 * second, 0, 0);
    CHECK(chassis.hummed_s(0, 9 * second) == doctest::Approx(3));
    chassis.set_duties(0, 10 * second, 65, 70);
    chassis.set_duties(0, 11 * second, 255, 255);
    chassis.set_duties(0, 11 * second + KICK, 65, 65);
    CHECK(chassis.hummed_s(0, 20 * second) == doctest::Approx(4));
}

TEST_CASE("one motor turns a robot on legs about the rear leg on the side it turns to") {
    Profile profile = kilobot();
    profile.kick_needed = false;
    for (bool left : {true, false}) {
        Chassis chassis(profile, LUCK, ALONE);
        Trajectory way(0, {{0.3, 0.2}, 0.7});
        way.change(0, chassis.set_duties(0, 0, left ? 70 : 0, left ? 0 : 70));
        CHECK(way.drive().turn == doctest::Approx(left ? 0.785 : -0.785));
        auto leg = [&](Cycles at) {
            Eigen::Vector2d ahead = way.ahead(at), aside(-ahead.y(), ahead.x());
            return Eigen::Vector2d(way.position(at) - 0.0092 * ahead +
                                   (left ? 0.0125 : -0.0125) * aside);
        };
        for (Cycles at : {ticks(10), ticks(100), ticks(1000)})
            CHECK((leg(at) - leg(0)).norm() < 1e-12);
    }
}

TEST_CASE("robots on legs differ, each in its own way and for good") {
    Profile profile = kilobot();
    profile.kick_needed = false;
    profile.speed_spread = 0.12;
    profile.bias_spread = 0.05;
    constexpr uint32_t COUNT = 2000;
    const Slots slots(COUNT);
    Chassis chassis(profile, LUCK, slots);
    double sum = 0, squares = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        Drive drive = chassis.set_duties(i, 0, 65, 65);
        CHECK(drive.velocity.norm() <= chassis.fastest_m_s());
        sum += drive.velocity.x();
        squares += drive.velocity.x() * drive.velocity.x();
        CHECK(chassis.next_renewal(i) == NEVER);
    }
    double mean = sum / COUNT, sd = std::sqrt(squares / COUNT - mean * mean);
    // Two motors, each with its bias: 0.12 and 0.05 / sqrt(2) together. Bounds are five standard
    // errors wide.
    double expected = 0.01 * std::sqrt(0.12 * 0.12 + 0.05 * 0.05 / 2);
    CHECK(std::abs(mean - 0.01) < 5 * expected / std::sqrt(COUNT));
    CHECK(std::abs(sd - expected) < 5 * expected / std::sqrt(2.0 * COUNT));
}

TEST_CASE("motor noise is drawn anew each second while a motor turns, and at no other time") {
    Profile profile = kilobot();
    profile.kick_needed = false;
    profile.motor_noise = 0.05;
    Chassis chassis(profile, LUCK, ALONE);
    CHECK(chassis.next_renewal(0) == NEVER);
    Drive first = chassis.set_duties(0, ticks(3), 65, 65);
    CHECK(chassis.next_renewal(0) == ticks(3) + CYCLES_PER_SECOND);
    Drive second = chassis.renew(0);
    CHECK_FALSE(first == second);
    CHECK(chassis.next_renewal(0) == ticks(3) + 2 * CYCLES_PER_SECOND);
    chassis.set_duties(0, ticks(90), 0, 0);
    CHECK(chassis.next_renewal(0) == NEVER);
}

TEST_CASE("a robot drives along a circle in closed form") {
    Trajectory way(0, {{1, 2}, 0.6});
    way.change(0, {{0.1, 0}, 0.5});
    for (Cycles at : {ticks(7), ticks(500)}) {
        double angle = 0.5 * seconds(at), radius = 0.1 / 0.5;
        Eigen::Vector2d centre = Eigen::Vector2d(1, 2) + radius * direction(0.6 + PI / 2);
        CHECK((way.position(at) - (centre + radius * direction(0.6 - PI / 2 + angle))).norm() <
              1e-12);
    }
}

TEST_CASE("a robot drives along its heading in closed form") {
    Trajectory way(ticks(5), {{1, 2}, 0.6});
    way.change(ticks(5), {{0.1, 0}, 0});
    double s = seconds(ticks(1000));
    Pose pose = way.pose(ticks(1005));
    CHECK(pose.position.x() == doctest::Approx(1 + 0.1 * s * std::cos(0.6)).epsilon(1e-14));
    CHECK(pose.position.y() == doctest::Approx(2 + 0.1 * s * std::sin(0.6)).epsilon(1e-14));
    CHECK(pose.heading == 0.6);
    CHECK(way.position(ticks(1005)) == pose.position);
}

TEST_CASE("a robot turns on the spot in closed form, over many turns") {
    Trajectory way(0, {{1, 2}, 0.5});
    way.change(0, {{0, 0}, 1.43});
    double s = seconds(ticks(10'000));
    Pose pose = way.pose(ticks(10'000));
    CHECK(pose.position == Eigen::Vector2d(1, 2));
    CHECK(std::abs(std::remainder(pose.heading - (0.5 + 1.43 * s), 2 * PI)) < 1e-11);
    CHECK(std::abs(pose.heading) <= PI);
    CHECK((way.ahead(ticks(10'000)) - direction(pose.heading)).norm() < 1e-15);
}

TEST_CASE("a change of motion keeps the pose of that moment") {
    Trajectory way(0, {{0, 0}, 0});
    way.change(0, {{0.1, 0}, 0});
    way.change(CYCLES_PER_SECOND * 2, {{0, 0}, 1});  // 0.2 m along x, then a quarter turn
    way.change(static_cast<Cycles>(CYCLES_PER_SECOND * (2 + PI / 2)), {{0.1, 0}, 0});
    Pose pose = way.pose(static_cast<Cycles>(CYCLES_PER_SECOND * (3 + PI / 2)));
    CHECK((pose.position - Eigen::Vector2d(0.2, 0.1)).norm() < 1e-7);
    CHECK(std::abs(pose.heading - PI / 2) < 1e-6);
    way.change(CYCLES_PER_SECOND * 10, {});
    CHECK(way.position(CYCLES_PER_SECOND * 10) == way.position(CYCLES_PER_SECOND * 99));
}

TEST_CASE("where a robot is does not depend on how often one asks") {
    Trajectory asked(0, {{0.3, -0.2}, 2.5}), not_asked = asked;
    asked.change(0, {{0.07, 0}, 0});
    not_asked.change(0, {{0.07, 0}, 0});
    for (uint64_t i = 1; i < 100; i++) (void)asked.pose(ticks(i));
    CHECK(asked.position(ticks(777)) == not_asked.position(ticks(777)));
}

TEST_CASE("a robot that changes its drive after ten years goes on to the cycle") {
    constexpr Cycles TEN_YEARS = CYCLES_PER_SECOND * 86'400 * 3653 + 1;
    Trajectory late(TEN_YEARS, {{0.3, -0.2}, 2.5}), early(0, {{0.3, -0.2}, 2.5});
    late.change(TEN_YEARS, {{0.01, 0.001}, 0.3});
    early.change(0, {{0.01, 0.001}, 0.3});
    for (Cycles time : {Cycles{1}, TICK_CYCLES - 1, ticks(300) + 7}) {
        CHECK(late.position(TEN_YEARS + time) == early.position(time));
        CHECK(late.heading(TEN_YEARS + time) == early.heading(time));
    }
}

}  // namespace test_motion
