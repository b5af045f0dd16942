#include "infrared/receivers_in_range.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "support.h"

using namespace kilotwin;
using kilotwin::testing::Dice;

namespace test_receivers_in_range {

namespace {

using Positions = std::vector<Eigen::Vector2d>;

constexpr double RANGE = 0.8, RADIUS = 0.085;

std::vector<Receiver> audience(const Positions &positions, uint32_t sender,
                               bool line_of_sight = true) {
    Team alone;
    Neighbours neighbours(RANGE + RADIUS, 0.3, alone);
    neighbours.rebuild(positions);
    const Arena arena = kilotwin::testing::square_hall(10);
    ReceiversInRange medium(RANGE, line_of_sight, RADIUS, arena, positions.size());
    return medium.find(
        sender, neighbours.of(sender), [&](uint32_t robot) { return positions[robot]; }, false);
}

std::vector<uint32_t> who(const std::vector<Receiver> &listeners) {
    std::vector<uint32_t> out;
    for (const auto &listener : listeners) out.push_back(listener.robot);
    return out;
}

using Who = std::vector<uint32_t>;

double distance_to_segment(const Eigen::Vector2d &p, const Eigen::Vector2d &a,
                           const Eigen::Vector2d &b) {
    double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    return (a + t * (b - a) - p).norm();
}

}  // namespace

TEST_CASE("the audience last kept stays, whoever is asked for in the meantime") {
    const Positions positions{{0, 0}, {0.3, 0}, {0, 0.5}};
    Team alone;
    Neighbours neighbours(RANGE + RADIUS, 0.3, alone);
    neighbours.rebuild(positions);
    const Arena arena = kilotwin::testing::square_hall(10);
    ReceiversInRange medium(RANGE, false, RADIUS, arena, positions.size());
    auto find = [&](uint32_t sender, const Positions &places, bool keep) {
        return who(medium.find(
            sender, neighbours.of(sender), [&](uint32_t robot) { return places[robot]; }, keep));
    };
    CHECK(medium.kept(0).empty());
    CHECK(find(0, positions, true) == Who{1, 2});
    CHECK(find(1, positions, true) == Who{0, 2});
    CHECK(find(0, {{0, 0}, {0.3, 0}, {0, 0.9}}, false) == Who{1});
    CHECK(who(medium.kept(0)) == Who{1, 2});
    CHECK(who(medium.kept(1)) == Who{0, 2});
}

TEST_CASE("range goes from centre to centre, its end included") {
    CHECK(who(audience({{0, 0}, {0.8, 0}, {0, 0.8000001}, {-0.5, -0.5}}, 0)) == Who{1, 3});
}

TEST_CASE("a listener is told its distance in millimetres") {
    auto found = audience({{0, 0}, {0.3, 0.4}, {-0.1706, 0}}, 0);
    REQUIRE(found.size() == 2);
    CHECK(found[0].distance_mm == 500);
    CHECK(found[1].distance_mm == 171);
}

TEST_CASE("a robot in between hides the one behind it") {
    CHECK(who(audience({{0, 0}, {0.3, 0}, {0.6, 0}}, 0)) == Who{1});
    CHECK(who(audience({{0, 0}, {0.3, 0}, {0.6, 0}}, 1)) == Who{0, 2});
    CHECK(who(audience({{0, 0}, {0.3, 0}, {0.6, 0}}, 2)) == Who{1});
    CHECK(who(audience({{0, 0}, {0.3, 0}, {0.6, 0}}, 0, false)) == Who{1, 2});
}

TEST_CASE("a disc hides only what the straight line through it leads to") {
    CHECK(who(audience({{0, 0}, {0.3, 0.0851}, {0.6, 0}}, 0)) == Who{1, 2});
    CHECK(who(audience({{0, 0}, {0.3, 0.0849}, {0.6, 0}}, 0)) == Who{1});
    CHECK(who(audience({{0, 0}, {-0.2, 0}, {0.6, 0}}, 0)) == Who{1, 2});  // behind the sender
    CHECK(who(audience({{0, 0}, {0.7, 0}, {0.5, 0}}, 0)) == Who{2});      // and behind the listener
}

TEST_CASE("a chain of touching robots is heard link by link") {
    Positions chain;
    for (int i = 0; i < 6; i++) chain.emplace_back(0.17 * i, 0);
    CHECK(who(audience(chain, 0)) == Who{1});
    CHECK(who(audience(chain, 3)) == Who{2, 4});
    CHECK(who(audience(chain, 0, false)) == Who{1, 2, 3, 4});
}

TEST_CASE("a ring around a sender closes it off") {
    Positions positions = {{0, 0}};
    for (int i = 0; i < 6; i++)
        positions.emplace_back(0.17 * std::cos(i * M_PI / 3), 0.17 * std::sin(i * M_PI / 3));
    for (int i = 0; i < 40; i++)
        positions.emplace_back(0.6 * std::cos(i * M_PI / 20), 0.6 * std::sin(i * M_PI / 20));
    // Six touching discs hide everything but, at most, the six directions between them.
    CHECK(audience(positions, 0).size() <= 12);
    CHECK(audience(positions, 0).size() >= 6);
}

TEST_CASE("random crowds hear what brute force says, and each other") {
    for (uint64_t seed = 1; seed <= 30; seed++) {
        Dice dice(seed);
        Positions positions;
        for (int i = 0; i < 60; i++) positions.emplace_back(dice.between(0, 3), dice.between(0, 3));
        bool sight = seed % 3 != 0;
        std::vector<Who> heard_by;
        for (uint32_t i = 0; i < positions.size(); i++)
            heard_by.push_back(who(audience(positions, i, sight)));
        for (uint32_t i = 0; i < positions.size(); i++)
            for (uint32_t j = 0; j < positions.size(); j++) {
                if (i == j) continue;
                bool expected = (positions[i] - positions[j]).norm() <= RANGE;
                for (uint32_t k = 0; k < positions.size() && sight; k++) {
                    if (k == i || k == j) continue;
                    Eigen::Vector2d ray = positions[j] - positions[i];
                    double along = (positions[k] - positions[i]).dot(ray) / ray.squaredNorm();
                    if (along > 0 && along < 1 &&
                        distance_to_segment(positions[k], positions[i], positions[j]) < RADIUS)
                        expected = false;
                }
                bool hears = std::binary_search(heard_by[i].begin(), heard_by[i].end(), j);
                bool heard = std::binary_search(heard_by[j].begin(), heard_by[j].end(), i);
                CHECK(hears == expected);
                CHECK(hears == heard);
            }
    }
}

TEST_CASE("a wall that blocks light hides what is behind it, others do not") {
    const Positions positions{{0, 0}, {0.4, 0}, {0, 0.4}};
    Team alone;
    Neighbours neighbours(RANGE + RADIUS, 0.3, alone);
    neighbours.rebuild(positions);
    for (bool blocks_light : {true, false}) {
        Arena arena = kilotwin::testing::square_hall(10);
        arena.obstacles = {{{Region::Shape::RECTANGLE, {0.2, 0}, {0.01, 0.3}}, blocks_light}};
        arena.build_walls(false, 3 * RADIUS);
        ReceiversInRange medium(RANGE, false, RADIUS, arena, positions.size());
        const auto heard = who(medium.find(
            0, neighbours.of(0), [&](uint32_t robot) { return positions[robot]; }, false));
        CHECK(heard == (blocks_light ? Who{2} : Who{1, 2}));
    }
}

}  // namespace test_receivers_in_range
