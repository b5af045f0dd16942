// Bodies: robots stop at one another and at walls, push and resist, and the solver sees all that
// matters.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "base/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_contacts {

namespace {

constexpr double RADIUS = 0.085, DIAMETER = 0.17;
constexpr double SPEED_PER_TICK = 0.1 * TICK_S;

double gap(const Samples &samples, uint32_t a, uint32_t b, size_t row = 0) {
    return (pose_of(samples, a, row).position - pose_of(samples, b, row).position).norm() -
           DIAMETER;
}

/// Poses of all robots after each sample period.
Samples run(Scene &scene, int64_t duration_ticks, uint32_t sample_ticks = 8) {
    scene.def.sample_ticks = sample_ticks;
    Simulation simulation(scene.def);
    simulation.advance(duration_ticks);
    return simulation.take_samples();
}

size_t last_row(const Samples &samples) { return samples.tick.size() - 1; }

/// The same scene with every robot in Box2D at every step, at 16 sub-steps a tick: what the engine
/// has to agree with. Robots drive from the beginning on as `drives` says.
std::vector<Pose> all_in_box2d(const Scene &scene, std::vector<Pose> poses,
                               const std::vector<Drive> &drives, int64_t duration_ticks) {
    const double speed = scene.def.profile.speed_m_s;
    Team alone;
    Contacts contacts(scene.def.arena, scene.def.profile, alone, speed, 1.1 * speed, poses.size(),
                      {}, Box2DSolver::Accuracy::ORACLE);
    const double step_s = scene.def.step_ticks * TICK_S;
    auto free = [&](size_t i) {
        return Shift{direction(poses[i].heading) * drives[i].velocity.x() * step_s,
                     drives[i].turn * step_s};
    };
    auto count = static_cast<uint32_t>(poses.size());
    Crowd crowd{std::vector<ContactBody>(count), {}, {{0, count, {}}}};
    for (uint32_t i = 0; i < count; i++)
        crowd.driven.push_back(Contacts::driven_as(poses[i].heading, drives[i]));
    for (int64_t tick = 0; tick < duration_ticks; tick += scene.def.step_ticks) {
        auto &bodies = crowd.bodies;
        for (uint32_t i = 0; i < count; i++) {
            bodies[i] = {poses[i], free(i)};
            bodies[i].robot = i;
        }
        contacts.step(crowd, {}, step_s);
        for (uint32_t i = 0; i < count; i++) {
            poses[i].position += bodies[i].moved.by;
            poses[i].heading = wrapped(poses[i].heading + bodies[i].moved.turn);
        }
    }
    return poses;
}

/// Compares a run of puppets with the all-in-Box2D run, at the end of each of ten parts. Returns
/// the largest difference in place.
double worst_difference(const std::string &what, const Arena &arena, const std::vector<Pose> &poses,
                        const std::vector<Drive> &drives, int64_t duration_ticks) {
    Scene scene(arena);
    scene.def.step_ticks = 1;
    scene.add("puppet", poses);
    for (uint32_t i = 0; i < poses.size(); i++)
        if (!drives[i].at_rest()) scene.motors(0, i, FULL, FULL);
    auto samples = run(scene, duration_ticks, static_cast<uint32_t>(duration_ticks / 10));
    double worst = 0;
    for (size_t row = 1; row < samples.tick.size(); row++) {
        auto expected = all_in_box2d(scene, poses, drives, samples.tick[row]);
        for (uint32_t i = 0; i < poses.size(); i++)
            worst =
                std::max(worst, (pose_of(samples, i, row).position - expected[i].position).norm());
    }
    MESSAGE(what << ": " << 100 * worst / DIAMETER << " % of a diameter");
    return worst;
}

const Drive FORWARD = {{0.1, 0}, 0};

}  // namespace

TEST_CASE("two robots head-on stop where they touch") {
    for (uint32_t step : {1u, 2u, 4u}) {
        Scene scene(square_hall(6));
        scene.def.step_ticks = step;
        scene.add("puppet", {{{-0.5, 0}, 0}, {{0.5, 0}, PI}});
        scene.motors(0, 0, FULL, FULL);
        scene.motors(0, 1, FULL, FULL);
        auto samples = run(scene, 400, 4);
        for (size_t row = 0; row <= last_row(samples); row++) {
            CHECK(gap(samples, 0, 1, row) > -0.05 * DIAMETER);
            // Free until they meet, 0.415 m on: tick 126.
            if (samples.tick[row] < 120) {
                double way = SPEED_PER_TICK * static_cast<double>(samples.tick[row]);
                CHECK(pose_of(samples, 0, row).position.x() ==
                      doctest::Approx(-0.5 + way).epsilon(1e-4));
            }
        }
        size_t last = last_row(samples);
        CHECK(std::abs(gap(samples, 0, 1, last)) < 0.01 * DIAMETER);
        CHECK((pose_of(samples, 0, last).position - Eigen::Vector2d(-RADIUS, 0)).norm() < 0.01);
        CHECK(std::abs(pose_of(samples, 0, last).heading) < 0.05);
    }
}

TEST_CASE("a robot drives into a wall from any side and never through it") {
    for (uint32_t step : {1u, 2u, 4u})
        for (bool round : {true, false}) {
            CAPTURE(round);
            Scene scene(round ? round_hall(8) : square_hall(8));
            scene.def.step_ticks = step;
            // One robot for each direction, and one that meets the wall aslant.
            std::vector<Pose> poses;
            for (int i = 0; i < 24; i++) {
                double angle = (i + 0.37) * PI / 12;
                Eigen::Vector2d outward = direction(angle);
                double edge = round ? 4 : 4 / outward.cwiseAbs().maxCoeff();
                poses.push_back({outward * (edge - 0.5), angle + (i % 2) * 0.5});
            }
            uint32_t count = static_cast<uint32_t>(poses.size());
            scene.add("puppet", poses);
            for (uint32_t i = 0; i < count; i++) scene.motors(0, i, FULL, FULL);
            auto samples = run(scene, 600, 4);
            for (size_t row = 0; row <= last_row(samples); row++)
                for (uint32_t i = 0; i < count; i++)
                    CHECK(scene.def.arena.wall_gap(pose_of(samples, i, row).position) >
                          0.95 * RADIUS);
            for (uint32_t i = 0; i < count; i++)
                CHECK(scene.def.arena.wall_gap(pose_of(samples, i, last_row(samples)).position) <
                      1.02 * RADIUS);
        }
}

TEST_CASE("the round wall is where the arena says, all around") {
    Scene scene(round_hall(19.2));
    std::vector<Pose> poses;
    for (int i = 0; i < 40; i++) {
        double angle = i * PI / 20 + 0.001 * i;
        poses.push_back({direction(angle) * 9.45, angle});
    }
    scene.add("puppet", poses);
    for (uint32_t i = 0; i < 40; i++) scene.motors(0, i, FULL, FULL);
    auto samples = run(scene, 200);
    for (uint32_t i = 0; i < 40; i++) {
        double wall_gap = 9.6 - pose_of(samples, i, last_row(samples)).position.norm() - RADIUS;
        CHECK(std::abs(wall_gap) < 0.01 * DIAMETER);
    }
}

TEST_CASE("a robot that meets a wall aslant slides along it") {
    Scene scene(square_hall(8));
    scene.add("puppet", {{{3.5, 0}, PI / 4}});
    scene.motors(0, 0, FULL, FULL);
    auto samples = run(scene, 600);
    Pose pose = pose_of(samples, 0, last_row(samples));
    CHECK(pose.position.x() == doctest::Approx(4 - RADIUS).epsilon(0.001));
    // Friction slows it and turns it towards the wall.
    CHECK(pose.position.y() > 0.2);
    CHECK(pose.position.y() < SPEED_PER_TICK * 600 * std::sin(PI / 4));
    CHECK(std::abs(pose.heading) <= PI / 4);
}

TEST_CASE(
    "a robot with its motors off resists: it is pushed, but slower than its pusher drives freely") {
    for (uint32_t step : {1u, 2u, 4u}) {
        Scene scene(square_hall(8));
        scene.def.step_ticks = step;
        scene.add("puppet", {{{-0.2, 0}, 0}, {{0, 0}, 0}});
        scene.motors(0, 0, FULL, FULL);
        scene.motors(600, 0, 0, 0);
        auto samples = run(scene, 800, 8);
        double contact_tick = 0.03 / SPEED_PER_TICK, pushed = 0, worst = 0;
        for (size_t row = 0; row <= last_row(samples); row++) {
            worst = std::min(worst, gap(samples, 0, 1, row));
            if (samples.tick[row] <= 600) pushed = pose_of(samples, 1, row).position.x();
        }
        double speed = pushed / ((600 - contact_tick) * TICK_S);
        MESSAGE("a robot pushed by another moves at " << speed << " m/s, in steps of " << step
                                                      << " ticks");
        CHECK(speed < 0.06);
        CHECK(worst > -0.05 * DIAMETER);
        // A robot that is pushed no longer does not slide on.
        CHECK(pose_of(samples, 1, last_row(samples)).position.x() < pushed + 0.01);
    }
}

TEST_CASE("the harder a robot is to push, the more stand in a row") {
    double speed[4];
    for (int resting = 0; resting < 4; resting++) {
        Scene scene(square_hall(10));
        std::vector<Pose> poses = {{{-3, 0}, 0}};
        for (int i = 0; i < resting; i++) poses.push_back({{-3 + (i + 1) * DIAMETER, 0}, 0});
        scene.add("puppet", poses);
        scene.motors(0, 0, FULL, FULL);
        auto samples = run(scene, 400);
        speed[resting] = (pose_of(samples, 0, last_row(samples)).position.x() + 3) / (400 * TICK_S);
        MESSAGE("pushing " << resting << ": " << speed[resting] << " m/s");
    }
    CHECK(speed[0] == doctest::Approx(0.1).epsilon(0.001));
    for (int resting = 1; resting < 4; resting++) CHECK(speed[resting] < speed[resting - 1]);
}

TEST_CASE("robots that do not give way are met as walls are, and drive off as ever") {
    for (bool gives_way : {true, false})
        for (uint32_t driver : {0u, 1u}) {
            CAPTURE(gives_way);
            CAPTURE(driver);
            const uint32_t other = 1 - driver;
            Scene scene(square_hall(4));
            scene.def.profile.gives_way = gives_way;
            std::vector<Pose> poses(2);
            poses[driver] = {{-0.5, 0}, 0};
            scene.add("puppet", poses);
            scene.motors(0, driver, FULL, FULL);
            scene.motors(500, other, FULL, FULL);
            const Samples samples = run(scene, 900, 100);
            const double pushed = pose_of(samples, other, 4).position.x();
            CHECK((gives_way ? pushed > 0.05 : pushed == 0));
            CHECK(std::abs(gap(samples, 0, 1, 4)) < 0.05 * DIAMETER);
            CHECK(pose_of(samples, other, last_row(samples)).position.x() > pushed + 0.5);
        }
}

TEST_CASE("a robot at rest stays where it is, also beside one that passes") {
    Scene scene(square_hall(6));
    scene.add("puppet", {{{-0.6, 0.1705}, 0}, {{0, 0}, 1}, {{0, 0.341}, 2}});
    scene.motors(0, 0, FULL, FULL);
    Simulation simulation(scene.def);
    simulation.advance(400);
    CHECK(simulation.statistics().solver_steps > 0);
    auto samples = simulation.snapshot();
    // Robot 0 went between the two, 0.5 mm from each, in and out of the solver: as in closed form.
    double way = SPEED_PER_TICK * 400;
    CHECK((pose_of(samples, 0).position - Eigen::Vector2d(-0.6 + way, 0.1705)).norm() < 1e-5);
    CHECK(std::abs(pose_of(samples, 0).heading) < 1e-6);
    CHECK((pose_of(samples, 1).position - Eigen::Vector2d(0, 0)).norm() < 1e-7);
    CHECK((pose_of(samples, 2).position - Eigen::Vector2d(0, 0.341)).norm() < 1e-7);
    CHECK(std::abs(pose_of(samples, 1).heading - 1) < 1e-6);
    CHECK(std::abs(pose_of(samples, 2).heading - 2) < 1e-6);
}

TEST_CASE("a robot turns beside others as if alone") {
    Scene scene(square_hall(6));
    scene.add("puppet", {{{0, 0}, 0}, {{0.175, 0}, 1}, {{-0.175, 0}, 0}});
    scene.motors(10, 0, 65, 0);
    scene.motors(10, 0, 65, 0);
    scene.motors(60, 0, 0, 0);
    scene.motors(70, 0, 0, 65);
    scene.motors(91, 0, 0, 0);
    auto samples = run(scene, 100);
    Pose pose = pose_of(samples, 0, last_row(samples));
    CHECK(pose.position.norm() < 1e-6);
    CHECK(std::abs(std::remainder(pose.heading - 1.43 * (50 - 21) * TICK_S, 2 * PI)) < 1e-3);
}

TEST_CASE("a motor change within a step acts at its moment, also in the solver") {
    for (uint32_t step : {1u, 2u, 4u}) {
        Scene scene(square_hall(6));
        scene.def.step_ticks = step;
        // The second one is near enough to be in the solver, and out of the way.
        scene.add("puppet", {{{0, 0}, PI / 2}, {{0.1705, 0.02}, 0}});
        scene.motors(3, 0, FULL, FULL);
        scene.motors(14, 0, 0, 0);
        Simulation simulation(scene.def);
        simulation.advance(40);
        CHECK(simulation.statistics().solver_steps > 0);
        double way = SPEED_PER_TICK * 11;
        CHECK(pose_of(simulation.snapshot(), 0).position.y() == doctest::Approx(way).epsilon(0.2));
    }
}

TEST_CASE("only robots near a moving body are in the solver") {
    Scene scene(square_hall(20));
    std::vector<Pose> poses;
    for (int i = 0; i < 10; i++) poses.push_back({{DIAMETER * i, 0}, 0});  // a resting pile
    for (int i = 0; i < 10; i++) poses.push_back({{-8, i - 5.0}, 0});      // far from all others
    scene.add("puppet", poses);
    for (uint32_t i = 10; i < 20; i++) scene.motors(0, i, FULL, FULL);
    Simulation simulation(scene.def);
    simulation.advance(20);  // RUN sets all motors once
    auto begin = simulation.statistics().solver_steps;
    simulation.advance(400);
    CHECK(simulation.statistics().solver_steps == begin);
}

TEST_CASE("all that stand in a chain are in the solver, and leave it together 2 steps after") {
    Scene scene(square_hall(20));
    std::vector<Pose> poses = {{{-0.3, 0}, 0}};
    for (int i = 0; i < 9; i++) poses.push_back({{DIAMETER * i, 0}, 0});
    scene.add("puppet", poses);
    scene.motors(0, 0, FULL, FULL);
    scene.motors(90, 0, 0, 0);
    Simulation simulation(scene.def);
    auto solver_steps_of = [&](int64_t ticks) {
        auto before = simulation.statistics().solver_steps;
        simulation.advance(ticks);
        return simulation.statistics().solver_steps - before;
    };
    solver_steps_of(20);              // RUN sets all motors once
    CHECK(solver_steps_of(16) == 0);  // 0.13 m to go, less a step and the margin: tick 38
    CHECK(solver_steps_of(54) >= 10 * 25);
    CHECK(solver_steps_of(10) <= 10 * 3);
    CHECK(solver_steps_of(100) == 0);
}

TEST_CASE("a chain of ten agrees with a run that has all robots in Box2D") {
    std::vector<Pose> poses;
    std::vector<Drive> drives;
    for (int i = 0; i < 10; i++) {
        poses.push_back({{-1 + 0.2 * i, 0}, 0});  // 30 mm apart
        drives.push_back(i == 0 ? FORWARD : Drive{});
    }
    double worst = worst_difference("chain of ten", square_hall(10), poses, drives, 400);
    CHECK(worst < 0.033 * DIAMETER);

    // Five from either end.
    for (size_t i = 0; i < 10; i++) {
        if (i >= 5) poses[i].heading = PI;
        drives[i] = FORWARD;
    }
    worst = worst_difference("five against five", square_hall(10), poses, drives, 400);
    CHECK(worst < 0.033 * DIAMETER);
}

TEST_CASE("a resting pile that others drive into agrees with a run that has all robots in Box2D") {
    std::vector<Pose> poses;
    std::vector<Drive> drives;
    for (int row = 0; row < 4; row++)
        for (int i = 0; i < 4; i++) {
            poses.push_back({{0.18 * i + 0.09 * (row % 2), 0.16 * row}, 0});
            drives.push_back({});
        }
    for (int i = 0; i < 3; i++) {
        poses.push_back({{-0.5, 0.05 + 0.2 * i}, 0});
        drives.push_back(FORWARD);
    }
    double worst = worst_difference("resting pile", square_hall(10), poses, drives, 300);
    CHECK(worst < 0.033 * DIAMETER);
}

TEST_CASE("two that meet aslant and one that slides along a wall go as in a run by Box2D alone") {
    std::vector<Pose> poses = {{{-0.3, 0}, 0}, {{0.3, 0.07}, PI}, {{1.5, -1.5}, PI / 4}};
    const double worst =
        worst_difference("alone", square_hall(4), poses, {FORWARD, FORWARD, FORWARD}, 200);
    CHECK(worst < 0.033 * DIAMETER);
}

TEST_CASE("a robot that leaves an island and joins one again elsewhere goes on from there") {
    using Kind = ContactBody::Kind;
    const Scene scene(square_hall(10));
    Team alone;
    Contacts contacts(scene.def.arena, scene.def.profile, alone, 0.1, 0.11, 3);
    Crowd crowd{{}, std::vector<DrivenBody>(3), {{0, 3, {}}}};
    auto step = [&](double y, double spacing, Kind kind) {
        crowd.shares[0].pairs = {{0, 1, spacing}, {1, 2, spacing}};
        auto &bodies = crowd.bodies;
        bodies.assign(3, {});
        for (uint32_t i = 0; i < 3; i++) {
            bodies[i].robot = i;
            bodies[i].pose.position = {spacing * i, y};
            bodies[i].kind = kind;
        }
        contacts.step(crowd, {}, 2 * TICK_S);
        return bodies[2].moved.by.x() - bodies[0].moved.by.x();
    };
    CHECK(std::abs(step(0, 1.1 * DIAMETER, Kind::ISLAND)) < 1e-6);
    CHECK(std::abs(step(1, 1.1 * DIAMETER, Kind::NONE)) < 1e-6);
    CHECK(step(2, 0.95 * DIAMETER, Kind::ISLAND) > 1e-3);  // they overlap, and part
}

TEST_CASE("robots in a corner agree with a run that has all robots in Box2D") {
    std::vector<Pose> poses;
    std::vector<Drive> drives;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            poses.push_back({{1.0 + 0.25 * i, 1.0 + 0.26 * j}, PI / 4 + 0.1 * (i - j)});
            drives.push_back(FORWARD);
        }
    double worst = worst_difference("corner", square_hall(4), poses, drives, 400);
    CHECK(worst < 0.033 * DIAMETER);
}

namespace {

/// A square hall of 4 m, turned by `angle`, with a pillar of 0.6 m in its middle.
Arena turned_hall(double angle) {
    Arena arena = {Region{Region::Shape::RECTANGLE, {0, 0}, {4, 4}}.placed({0, 0}, angle),
                   {},
                   {{{Region::Shape::CIRCLE, {0, 0}, {0.6, 0.6}}, false}}};
    arena.build_walls(false, 3 * RADIUS);
    return arena;
}

}  // namespace

TEST_CASE("at walls of any angle, corners that stick out and pillars all go as in Box2D alone") {
    for (int i = 0; i < 8; i++) {
        const double angle = 0.1 + 0.37 * i;
        auto turned = [&](double x, double y) {
            const Eigen::Vector2d ahead = direction(angle);
            return Eigen::Vector2d(ahead.x() * x - ahead.y() * y, ahead.y() * x + ahead.x() * y);
        };
        // Along a wall, straight on, and past the pillar on either side.
        const double worst = worst_difference("turned walls", turned_hall(angle),
                                              {{turned(1.5, -1.5), angle + PI / 4},
                                               {turned(-1.5, 1.6), angle + PI / 2 + 0.2},
                                               {turned(-0.7, 0.2), angle},
                                               {turned(0.7, -0.1), angle + PI}},
                                              {FORWARD, FORWARD, FORWARD, FORWARD}, 400);
        CHECK(worst < 0.033 * DIAMETER);
    }
}

TEST_CASE("robots go around a corner that sticks out as in Box2D alone") {
    Arena arena = {Region::polygon({{-2, -2}, {2, -2}, {2, 0}, {0.3, 0.1}, {0.1, 2}, {-2, 2}}), {}};
    arena.build_walls(false, 3 * RADIUS);
    const Pose ways[] = {{{1, -0.3}, 2.6},
                         {{1, -0.3}, 2.8},
                         {{-0.4, 1}, -1.1},
                         {{-0.1, 1}, -1.3},
                         {{-0.3, -0.4}, 0.7}};
    for (const Pose &way : ways) {
        const double worst =
            worst_difference("corner that sticks out", arena, {way}, {FORWARD}, 400);
        CHECK(worst < 0.033 * DIAMETER);
    }
}

TEST_CASE("robots in a nook of 30 degrees agree with a run that has all robots in Box2D") {
    Arena arena = {Region::polygon({{-2, -0.5}, {2, 0}, {-2, 1.6}}), {}};
    arena.build_walls(false, 3 * RADIUS);
    const double worst =
        worst_difference("nook", arena, {{{0.4, 0.2}, 0}, {{-0.2, 0.2}, 0.1}, {{-0.8, 0.4}, -0.2}},
                         {FORWARD, FORWARD, FORWARD}, 400);
    CHECK(worst < 0.05 * DIAMETER);
}

}  // namespace test_contacts
