// Objects: robots push them as mechanics says, and nothing passes a wall.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/trigonometry.h"
#include "physics/objects.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_objects {

namespace {

// Radius of foot_bot(), as the tests' puppets are.
constexpr double RADIUS = 0.085, DIAMETER = 0.17, SPEED = 0.1, PUSH_M_S2 = 1.0, MASS_KG = 1.8;
constexpr double PUSH_N = PUSH_M_S2 * MASS_KG;
constexpr double GRAVITY = 9.81;

ObjectPart box(double width_m, double height_m, const Eigen::Vector2d &centre = {0, 0}) {
    ObjectPart part;
    for (const auto &sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1), Eigen::Vector2d(1, 1),
                             Eigen::Vector2d(-1, 1)})
        part.corners.push_back(centre + sign.cwiseProduct(Eigen::Vector2d(width_m, height_m) / 2));
    return part;
}

ObjectPart disc(double radius_m) { return {{0, 0}, radius_m, {}}; }

/// An object that the table holds with `force_n`.
ObjectDef held(const ObjectPart &part, const Pose &pose, double mass_kg, double force_n) {
    const double friction = force_n / (mass_kg * GRAVITY);
    return {{part}, pose, mass_kg, friction, friction, 0.3};
}

struct Run {
    explicit Run(const Scene &scene) : simulation(scene.def) {}
    Simulation simulation;

    Pose object(uint32_t index = 0) const {
        const auto now = simulation.snapshot();
        return {{now.object_x_m[index], now.object_y_m[index]}, now.object_heading_rad[index]};
    }
    /// Mean velocity over some ticks from now on.
    double speed(int64_t ticks) {
        const double before = object().position.x();
        simulation.advance(ticks);
        return (object().position.x() - before) / (static_cast<double>(ticks) * TICK_S);
    }
};

/// `count` robots side by side, or in a row, that push a box to the right; the table holds it with
/// a share of what they push with.
Scene pushers(int count, bool in_a_row, double share, uint32_t step_ticks) {
    Scene scene(square_hall(8));
    scene.def.step_ticks = step_ticks;
    std::vector<Pose> poses;
    for (int i = 0; i < count; i++) {
        const double aside = in_a_row ? 0 : 0.18 * (i - (count - 1) / 2.0);
        poses.push_back({{-0.05 - RADIUS - (in_a_row ? i * DIAMETER : 0), aside}, 0});
    }
    scene.add("puppet", poses);
    for (uint32_t i = 0; i < poses.size(); i++) scene.motors(0, i, FULL, FULL);
    scene.def.objects = {held(box(0.1, 2), {{0, 0}, 0}, 5, share * count * PUSH_N)};
    return scene;
}

}  // namespace

TEST_CASE(
    "an object moves if and only if the robots' joint force beats the friction of the table") {
    for (uint32_t step : {1u, 2u, 4u})
        for (int count : {1, 2, 6})
            for (double share : {0.3, 0.9, 1.1, 3.0}) {
                CAPTURE(step);
                CAPTURE(count);
                CAPTURE(share);
                Run run(pushers(count, false, share, step));
                // Robots come with a momentum, which friction has to brake.
                run.simulation.advance(300);
                const double speed = run.speed(200);
                CHECK((share > 1 ? std::abs(speed) < 1e-3 * SPEED : speed > 0.5 * SPEED));
            }
}

TEST_CASE("an object moves at the speed at which the robots' force equals the table's friction") {
    // A drive's force ends with what its speed lacks: at push * tick it is at its limit.
    for (uint32_t step : {1u, 2u, 4u})
        for (int count : {1, 4})
            for (double share : {0.0, 0.25, 0.5, 0.75}) {
                CAPTURE(step);
                CAPTURE(count);
                CAPTURE(share);
                Run run(pushers(count, false, share, step));
                run.simulation.advance(200);
                const double expected = SPEED - share * PUSH_M_S2 * TICK_S;
                CHECK(run.speed(200) == doctest::Approx(expected).epsilon(0.02));
            }
}

TEST_CASE("a line of ten pushes as ten") {
    for (uint32_t step : {2u, 4u})
        for (double share : {0.5, 0.9, 1.1}) {
            CAPTURE(step);
            CAPTURE(share);
            Run run(pushers(10, true, share, step));
            run.simulation.advance(400);
            const double speed = run.speed(200);
            MESSAGE("ten in a line against " << share << " of their force: " << speed << " m/s");
            CHECK((share > 1 ? std::abs(speed) < 1e-3 * SPEED : speed > 0.5 * SPEED));
        }
}

TEST_CASE("a torque turns an object as its inertia says, and a force moves its middle") {
    for (uint32_t step : {1u, 4u}) {
        CAPTURE(step);
        Scene scene(square_hall(8));
        scene.def.step_ticks = step;
        const double lever_m = 0.4, width_m = 0.2, height_m = 1.2, mass_kg = 400;
        scene.add("puppet", {{{-width_m / 2 - RADIUS, lever_m}, 0}});
        scene.motors(0, 0, FULL, FULL);
        scene.def.objects = {held(box(width_m, height_m), {{0, 0}, 0}, mass_kg, 0)};
        Run run(scene);
        run.simulation.advance(20);  // it has met the box
        auto after = [&](int64_t ticks) {
            run.simulation.advance(ticks);
            return run.object();
        };
        // Second differences: what it does at first does not matter.
        const int64_t span = 60;
        const Pose a = run.object(), b = after(span), c = after(span);
        const double square = std::pow(static_cast<double>(span) * TICK_S, 2);
        const double inertia = mass_kg * (width_m * width_m + height_m * height_m) / 12;
        const double turns = (c.heading - 2 * b.heading + a.heading) / square;
        const double slides = (c.position - 2 * b.position + a.position).x() / square;
        CHECK(turns == doctest::Approx(-PUSH_N * lever_m / inertia).epsilon(0.02));
        CHECK(slides == doctest::Approx(PUSH_N / mass_kg).epsilon(0.02));
    }
}

TEST_CASE("an object turns if and only if the torque beats the friction against turning") {
    for (double share : {0.8, 1.2}) {
        CAPTURE(share);
        Scene scene(square_hall(8));
        const double lever_m = 0.4;
        scene.add("puppet", {{{-0.05 - RADIUS, lever_m}, 0}});
        scene.motors(0, 0, FULL, FULL);
        ObjectDef def = held(box(0.1, 1), {{0, 0}, 0}, 2, 10 * PUSH_N);  // does not slide
        const Object object(def);
        def.turning_friction *= share * PUSH_N * lever_m / object.most_torque_nm();
        scene.def.objects = {def};
        Run run(scene);
        run.simulation.advance(100);
        const double before = run.object().heading;
        run.simulation.advance(100);
        CHECK(run.object().position.norm() < 0.01 * DIAMETER);
        const double turned = run.object().heading - before;
        CHECK((share > 1 ? std::abs(turned) < 1e-3 : turned < -0.1));
    }
}

TEST_CASE("friction against turning acts at the mean distance from the middle") {
    const double weight_n = 2 * GRAVITY;
    ObjectDef def = {{disc(0.3)}, Pose(), 2, 0.5, 0.25, 0.3};
    CHECK(Object(def).most_force_n() == doctest::Approx(0.5 * weight_n));
    CHECK(Object(def).most_torque_nm() ==
          doctest::Approx(0.25 * weight_n * 0.3 * 2 / 3).epsilon(0.002));
    // A thin rod: a quarter of its length.
    def.parts = {box(0.001, 1)};
    CHECK(Object(def).most_torque_nm() == doctest::Approx(0.25 * weight_n / 4).epsilon(0.002));
}

TEST_CASE("the middle of parts that are joined is where their mass is") {
    ObjectDef def = {
        {box(0.2, 0.2, {0.5, 0}), box(0.2, 0.1, {-0.5, 0})}, Pose{{1, 2}, PI / 2}, 1, 0, 0, 0.3};
    const Object object(def);
    const Pose middle = object.middle_of(*def.pose);
    CHECK((middle.position - Eigen::Vector2d(1, 2 + 0.5 / 3)).norm() < 1e-9);
    CHECK((object.frame_of(middle).position - def.pose->position).norm() < 1e-12);
    CHECK(object.gap(middle, {1, 3}) == doctest::Approx(0.4));
    CHECK(object.gap(middle, {1, 2.5}) == doctest::Approx(-0.1));
}

TEST_CASE("parts that are no circle and no convex polygon are refused") {
    ObjectPart dart;
    dart.corners = {{0, 0}, {1, 0}, {0.2, 0.2}, {0, 1}};
    ObjectPart clockwise = box(1, 1);
    std::reverse(clockwise.corners.begin(), clockwise.corners.end());
    for (const auto &part : {dart, clockwise, ObjectPart()})
        CHECK_THROWS_AS(Object({{part}, Pose(), 1, 0, 0, 0.3}), EngineError);
    CHECK_THROWS_AS(Object({{}, Pose(), 1, 0, 0, 0.3}), EngineError);
}

TEST_CASE("energy never grows by itself, whatever collides with what") {
    // Three discs on ice: a robot drives into the first, and stops.
    Scene scene(square_hall(3));
    scene.add("puppet", {{{-0.8, 0.02}, 0}});
    scene.motors(0, 0, FULL, FULL);
    scene.motors(200, 0, 0, 0);
    for (int i = 0; i < 3; i++)
        scene.def.objects.push_back(held(disc(0.1), {{-0.4 + 0.3 * i, 0.01 * i}, 0}, 0.5, 0));
    Run run(scene);
    run.simulation.advance(200);
    auto energy = [&] {
        double sum = 0;
        Eigen::Vector2d before[3];
        for (uint32_t i = 0; i < 3; i++) before[i] = run.object(i).position;
        run.simulation.advance(8);
        for (uint32_t i = 0; i < 3; i++) sum += (run.object(i).position - before[i]).squaredNorm();
        return sum;
    };
    energy();
    double last = energy();
    CHECK(last > 0);
    for (int i = 0; i < 100; i++) {
        const double now = energy();
        CHECK(now <= last * 1.02 + 1e-9);
        last = now;
    }
}

TEST_CASE("objects that are pushed push others, none of which a robot is near") {
    for (uint32_t step : {1u, 4u}) {
        CAPTURE(step);
        Scene scene(square_hall(6));
        scene.def.step_ticks = step;
        scene.add("puppet", {{{-0.2 - RADIUS, 0}, 0}});
        scene.motors(0, 0, FULL, FULL);
        // Three discs in a line, a little apart; the table holds each with a fifth of the push.
        for (int i = 0; i < 3; i++)
            scene.def.objects.push_back(held(disc(0.2), {{0.45 * i, 0}, 0}, 2, PUSH_N / 5));
        Run run(scene);
        for (int i = 0; i < 40; i++) {
            run.simulation.advance(16);
            for (uint32_t k = 0; k < 2; k++)
                CHECK((run.object(k + 1).position - run.object(k).position).norm() >
                      0.4 - 0.02 * DIAMETER);
        }
        CHECK(run.object(2).position.x() > 0.9 + 0.5);
        CHECK(run.speed(100) > 0.1 * SPEED);
    }
}

TEST_CASE("objects that robots push against walls and into a corner stay inside, and whole") {
    for (uint32_t step : {1u, 4u}) {
        CAPTURE(step);
        Scene scene(square_hall(3));
        scene.def.step_ticks = step;
        std::vector<Pose> poses;
        for (int i = 0; i < 8; i++)
            poses.push_back({{-1 + 0.18 * (i % 4), -1 + 0.18 * std::floor(i / 4)}, PI / 4});
        scene.add("puppet", poses);
        for (uint32_t i = 0; i < 8; i++) scene.motors(0, i, FULL, FULL);
        scene.def.objects = {held(disc(0.2), {{0.2, 0.1}, 0}, 1, PUSH_N),
                             held(box(0.4, 0.2), {{0.6, 0.7}, 0.4}, 1, PUSH_N)};
        Run run(scene);
        for (int i = 0; i < 60; i++) {
            run.simulation.advance(32);
            const Pose round = run.object(0), other = run.object(1);
            CHECK(round.position.cwiseAbs().maxCoeff() < 1.5 - 0.2 + 0.02 * DIAMETER);
            const Eigen::Vector2d ahead = direction(other.heading);
            const Eigen::Vector2d half(std::abs(ahead.x()) * 0.2 + std::abs(ahead.y()) * 0.1,
                                       std::abs(ahead.y()) * 0.2 + std::abs(ahead.x()) * 0.1);
            CHECK((other.position.cwiseAbs() + half).maxCoeff() < 1.5 + 0.02 * DIAMETER);
            const auto now = run.simulation.snapshot();
            for (uint32_t robot = 0; robot < 8; robot++)
                CHECK((pose_of(now, robot).position - round.position).norm() >
                      0.2 + RADIUS - 0.05 * DIAMETER);
        }
        CHECK((run.object(0).position - Eigen::Vector2d(0.2, 0.1)).norm() > 0.5);
    }
}

TEST_CASE("an object that nothing is near takes no time, and stays where it is") {
    Scene scene(square_hall(6));
    scene.add("puppet", {{{-2, 0}, PI / 2}});
    scene.motors(0, 0, FULL, FULL);
    scene.def.objects = {held(disc(0.2), {{1, 0.5}, 0.3}, 1, 1)};
    Run run(scene);
    run.simulation.advance(300);
    CHECK(run.simulation.statistics().island_steps == 0);
    CHECK((run.object().position - Eigen::Vector2d(1, 0.5)).norm() < 1e-6);
    CHECK(run.object().heading == doctest::Approx(0.3));
}

TEST_CASE("objects and robots placed by chance overlap neither one another nor walls") {
    for (uint64_t seed = 1; seed <= 20; seed++) {
        Scene scene(square_hall(2.5), seed);
        ObjectDef round = held(disc(0.3), {}, 1, 1), rod = held(box(0.1, 0.8), {}, 1, 1);
        round.pose.reset();
        rod.pose.reset();
        scene.def.objects = {round, rod};
        scene.add_anywhere("puppet", 30);
        Run run(scene);
        const Object a(round), b(rod);
        const Pose at_a = run.object(0), at_b = run.object(1);
        CHECK(at_a.position.cwiseAbs().maxCoeff() < 1.25 - 0.3 + 1e-6);
        for (const auto &corner : b.points(at_b)) CHECK(corner.cwiseAbs().maxCoeff() < 1.25 + 1e-6);
        CHECK(b.gap(at_b, at_a.position) > 0.3);
        const auto now = run.simulation.snapshot();
        for (uint32_t robot = 0; robot < 30; robot++) {
            CHECK(a.gap(at_a, pose_of(now, robot).position) > RADIUS - 1e-6);
            CHECK(b.gap(at_b, pose_of(now, robot).position) > RADIUS - 1e-6);
        }
    }
}

}  // namespace test_objects
