// Walls of any shape: found where they are, seen from their free side, and passed by nobody.
#include "physics/walls.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "base/trigonometry.h"
#include "physics/placement.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_walls {

namespace {

constexpr double RADIUS = 0.085, REACH = 3 * RADIUS;

/// A star with corners of any sharpness, in either order.
Region star(Dice &dice, const Eigen::Vector2d &centre, double least, double most) {
    std::vector<Eigen::Vector2d> corners;
    const uint32_t count = 3 + dice.below(20);
    for (uint32_t i = 0; i < count; i++)
        corners.push_back(centre + dice.between(least, most) * direction(2 * PI * i / count));
    if (dice.below(2) == 0) std::reverse(corners.begin(), corners.end());
    return Region::polygon(corners);
}

Region box(const Eigen::Vector2d &centre, double width, double height, double heading = 0) {
    return Region{Region::Shape::RECTANGLE, {0, 0}, {width, height}}.placed(centre, heading);
}

Region round(const Eigen::Vector2d &centre, double diameter) {
    return {Region::Shape::CIRCLE, centre, {diameter, diameter}};
}

/// An arena with corners of 20 degrees and less, a turned plate, a wedge and a pillar near a wall.
Arena narrow_hall() {
    Arena arena = {Region::polygon({{-3, -2},
                                    {3, -1.6},
                                    {-0.8, -0.9},
                                    {2.5, 0.1},
                                    {3.5, 2},
                                    {0.5, 1.4},
                                    {-3, 2.2},
                                    {-2, 0.6}}),
                   {},
                   {{round({-1.2, 0.2}, 0.5), true},
                    {box({0.6, 0.6}, 0.9, 0.02, 0.7), true},
                    {Region::polygon({{-1, -1.3}, {-0.2, -1.3}, {-0.9, -1.1}}), true},
                    {round({2.2, 1.4}, 0.3), true}}};
    arena.build_walls(true, REACH);
    return arena;
}

struct Seen {
    double gap;
    Eigen::Vector2d outward;
    uint32_t wall;
};

std::vector<Seen> seen_from(const Walls &walls, const Eigen::Vector2d &point, double reach) {
    std::vector<Seen> seen;
    walls.for_each(point, reach, [&](double gap, const Eigen::Vector2d &outward, uint32_t wall) {
        seen.push_back({gap, outward, wall});
    });
    return seen;
}

}  // namespace

TEST_CASE("the gap to a wall is the distance to the nearest edge, from either side") {
    Dice dice(5);
    for (int scene = 0; scene < 40; scene++) {
        const Region bounds = star(dice, {0.3, -0.2}, 1, 4), stone = star(dice, {0.2, 0}, 0.1, 0.6);
        const Walls walls(bounds, false, {{stone, false}}, REACH);
        for (int i = 0; i < 2000; i++) {
            const Eigen::Vector2d here(dice.between(-4, 4), dice.between(-4, 4));
            const bool is_free = bounds.contains(here) && !stone.contains(here);
            const double away =
                std::min(bounds.distance_to_edge(here), stone.distance_to_edge(here));
            const double gap = walls.gap(here);
            CHECK((gap >= 0) == is_free);
            if (away <= REACH)
                CHECK(std::abs(gap) == doctest::Approx(away).epsilon(1e-9));
            else
                CHECK(std::abs(gap) <= away * (1 + 1e-12));
            if (away > REACH) CHECK(std::abs(gap) >= REACH * (1 - 1e-12));
        }
    }
}

TEST_CASE("it is a lower bound in the open, and no bad one") {
    const Walls walls(box({0, 0}, 8, 6), false, {}, REACH);
    CHECK(walls.gap({0, 0}) > 2.5);
    CHECK(walls.gap({0, 0}) <= 3);
}

TEST_CASE("the nearest of the walls that are seen is at the gap, in the direction of its normal") {
    Dice dice(6);
    for (int scene = 0; scene < 40; scene++) {
        const Region bounds = star(dice, {0, 0}, 1, 3);
        const Walls walls(bounds, false, {{round({0, 0}, 0.5), false}}, REACH);
        for (int i = 0; i < 2000; i++) {
            const Eigen::Vector2d here(dice.between(-3, 3), dice.between(-3, 3));
            const double gap = walls.gap(here);
            const auto seen = seen_from(walls, here, REACH);
            if (gap >= REACH || gap < 0) continue;
            REQUIRE(!seen.empty());
            double least = INFINITY;
            for (const auto &[distance, outward, wall] : seen) {
                CHECK(outward.norm() == doctest::Approx(1));
                least = std::min(least, distance);
            }
            CHECK(least == doctest::Approx(gap).epsilon(1e-9));
            for (size_t i = 1; i < seen.size(); i++) CHECK(seen[i].wall > seen[i - 1].wall);
        }
    }
}

TEST_CASE("a wall is one, also beside its end; a nook is two; a corner that sticks out is one") {
    const Region ell = Region::polygon({{0, 0}, {4, 0}, {4, 2}, {2, 2}, {2, 4}, {0, 4}});
    const Walls walls(ell, false, {}, REACH);
    auto count = [&](double x, double y) { return seen_from(walls, {x, y}, 0.1).size(); };
    CHECK(count(2, 0.09) == 1);
    CHECK(count(0.3, 0.09) == 1);
    CHECK(count(0.09, 0.09) == 2);
    CHECK(count(2.5, 1.95) == 1);
    CHECK(count(2.02, 1.95) == 1);
    CHECK(count(1.95, 1.95) == 1);  // by the corner at (2, 2)
    CHECK(count(1, 1) == 0);
    const auto corner = seen_from(walls, {1.97, 1.96}, 0.1);
    REQUIRE(corner.size() == 1);
    CHECK(corner[0].gap == doctest::Approx(0.05));
    CHECK((corner[0].outward - Eigen::Vector2d(0.6, 0.8)).norm() < 1e-9);
}

TEST_CASE("corners on a straight edge, and the order of corners, change nothing") {
    const Walls plain(Region::polygon({{0, 0}, {4, 0}, {4, 3}, {0, 3}}), false, {}, REACH);
    const Walls other(Region::polygon({{0, 3}, {2, 3}, {4, 3}, {4, 0}, {3, 0}, {1, 0}, {0, 0}}),
                      false, {}, REACH);
    Dice dice(8);
    for (int i = 0; i < 5000; i++) {
        const Eigen::Vector2d here(dice.between(0, 4), dice.between(0, 3));
        CHECK(plain.gap(here) == doctest::Approx(other.gap(here)).epsilon(1e-12));
        CHECK(seen_from(plain, here, 0.2).size() == seen_from(other, here, 0.2).size());
    }
}

TEST_CASE("through a thin wall nothing of its other side is seen") {
    const Walls walls(box({0, 0}, 4, 4), false,
                      {{box({0, 0}, 0.002, 4), false}, {box({1.05, 0}, 2, 0.002), false}}, REACH);
    for (double y : {-0.05, 0.0, 0.001, 0.05, 0.1}) {
        CAPTURE(y);
        const auto seen = seen_from(walls, {-0.08, y}, 0.12);
        REQUIRE(seen.size() == 1);
        CHECK(seen[0].outward == Eigen::Vector2d(1, 0));
        CHECK(seen[0].gap == doctest::Approx(0.079));
    }
}

TEST_CASE("a maze of hundreds of walls is looked up as quickly as a box") {
    std::vector<Obstacle> plates;
    for (int i = 0; i < 20; i++)
        for (int j = 0; j < 20; j++)
            plates.push_back({box({i - 9.5, j - 9.5}, 0.6, 0.02, 0.3 * (i + j)), false});
    const Walls walls(box({0, 0}, 20, 20), false, plates, REACH);
    size_t most = 0;
    Dice dice(9);
    for (int i = 0; i < 10'000; i++) {
        const Eigen::Vector2d here(dice.between(-10, 10), dice.between(-10, 10));
        most = std::max(most, seen_from(walls, here, REACH).size());
    }
    CHECK(most <= 8);
}

TEST_CASE("light passes where no wall that blocks it is in between") {
    Dice dice(10);
    for (int scene = 0; scene < 20; scene++) {
        const Region bounds = star(dice, {0, 0}, 1, 3), stone = star(dice, {0.5, 0.4}, 0.1, 0.5);
        const Region pillar = round({-0.5, -0.3}, 0.3), glass = round({0, -0.8}, 0.4);
        const Walls walls(bounds, true, {{stone, true}, {pillar, true}, {glass, false}}, REACH);
        for (int i = 0; i < 500; i++) {
            const Eigen::Vector2d from(dice.between(-3, 3), dice.between(-3, 3));
            const Eigen::Vector2d to(dice.between(-3, 3), dice.between(-3, 3));
            auto is_clear = [&](const Eigen::Vector2d &at) {
                return bounds.contains(at) && !stone.contains(at) && !pillar.contains(at);
            };
            if (!is_clear(from) || !is_clear(to)) continue;
            double nearest = INFINITY;
            bool clear = true;
            for (int part = 0; part <= 2000; part++) {
                const Eigen::Vector2d at = from + (to - from) * (part / 2000.0);
                clear = clear && is_clear(at);
                for (const Region *region : {&bounds, &stone, &pillar})
                    nearest = std::min(nearest, region->distance_to_edge(at));
            }
            // Between the points that were tried it may touch a corner.
            if (clear && nearest < 0.004) continue;
            CHECK(walls.lets_light_pass(from, to) == clear);
        }
    }
}

TEST_CASE("robots are placed in what is free, evenly") {
    const Arena arena = narrow_hall();
    std::vector<Pose> poses;
    place_uniformly(poses, 60, arena, RADIUS, Chance(4));
    for (const Pose &pose : poses) {
        CHECK(arena.bounds.contains(pose.position));
        CHECK(arena.wall_gap(pose.position) >= RADIUS);
        for (const auto &obstacle : arena.obstacles) {
            CHECK_FALSE(obstacle.shape.contains(pose.position));
            CHECK(obstacle.shape.distance_to_edge(pose.position) >= RADIUS * (1 - 1e-12));
        }
    }
    // An arena that lies beside the origin, with a stone on its left half.
    Arena aside = {Region::polygon({{10, 10}, {14, 10}, {14, 12}, {10, 12}}),
                   {},
                   {{box({11, 11}, 1.8, 1.8), false}}};
    aside.build_walls(false, REACH);
    poses.clear();
    place_uniformly(poses, 50, aside, RADIUS, Chance(4));
    const auto right = std::count_if(poses.begin(), poses.end(),
                                     [](const Pose &pose) { return pose.position.x() > 12; });
    CHECK(right >= 46);  // 98 % of what is free for their middles
}

namespace {

/// Robots that walk at random, bodies alone, until there were so many robot-steps. Returns the
/// worst overlap as a share of a diameter.
double walk_at_random(const Arena &arena, double speed_m_s, uint32_t step_ticks,
                      double robot_steps) {
    constexpr uint32_t ROBOTS = 40;
    Profile profile = foot_bot();
    profile.speed_m_s = speed_m_s;
    const Chance chance(11);
    std::vector<Pose> poses;
    place_uniformly(poses, ROBOTS, arena, RADIUS, chance);
    const Cycles step = ticks(step_ticks);
    Team team;
    const Slots slots(poses.size());
    Bodies bodies(arena, profile, chance, slots, team, step, 0, poses, 0.3);
    Dice dice(12);
    Cycles now = 0;
    for (double done = 0; done < robot_steps; done += ROBOTS, now += step) {
        bodies.refresh_lists();
        // Each turns now and then; mostly they push on against whatever is there.
        for (uint32_t i = 0; i < 2; i++) {
            const uint32_t robot = dice.below(ROBOTS), way = dice.below(8);
            const bool left = way != 1, right = way != 2;
            bodies.command(robot, {now + dice.below(100) * (step / 100),
                                   static_cast<uint8_t>(left ? 70 : 0),
                                   static_cast<uint8_t>(right ? 70 : 0)});
        }
        bodies.step();
        for (uint32_t robot = 0; robot < ROBOTS; robot++) {
            const Eigen::Vector2d &at = bodies.position(robot);
            if (arena.wall_gap(at) < 0.5 * RADIUS || !arena.bounds.contains(at)) return INFINITY;
        }
    }
    return bodies.overlaps().worst();
}

}  // namespace

TEST_CASE("a robot that stops just before a step ends is stopped by what it drove into") {
    Profile profile = foot_bot();
    profile.speed_m_s = 1;  // 13 cm a step
    const Cycles step = ticks(4);
    Arena arena = {Region::polygon({{-2, -2}, {2, -2}, {2, 2}, {-2, 2}}), {}, {}};
    arena.build_walls(true, REACH);
    const Chance chance(1);
    Team team;
    const Slots slots(1);
    Bodies bodies(arena, profile, chance, slots, team, step, 0, {{{2 - RADIUS - 0.1, 0}, 0}}, 0.3);
    bodies.command(0, {0, 70, 70});
    bodies.command(0, {step - step / 100, 0, 0});
    bodies.refresh_lists();
    bodies.step();
    CHECK(bodies.position(0).x() == doctest::Approx(2 - RADIUS).epsilon(1e-3));
}

TEST_CASE("nothing passes a wall, at any speed and step") {
    const Arena arena = narrow_hall();
    for (uint32_t step_ticks : {1u, 2u, 4u})
        for (double speed : {0.1, 1.0}) {
            const double worst =
                walk_at_random(arena, speed, step_ticks, (thorough() ? 1e8 : 1e5) / 6);
            MESSAGE("steps of " << step_ticks << " ticks at " << speed << " m/s: overlap at most "
                                << 100 * worst << " % of a diameter");
            CHECK(worst < 0.05);
        }
}

TEST_CASE("a robot that others drive into an acute nook is not wedged in deeper and deeper") {
    // The nook at (3, -1.6) is 14 degrees wide: friction holds what is in it.
    for (uint32_t step_ticks : {2u, 4u}) {
        CAPTURE(step_ticks);
        const double worst = walk_at_random(narrow_hall(), 0.1, step_ticks, 6e6);
        CHECK(worst < 0.05);
    }
}

}  // namespace test_walls
