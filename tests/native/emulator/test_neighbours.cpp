#include "physics/neighbours.h"

#include <doctest/doctest.h>

#include <memory>

#include "support.h"

using namespace kilotwin;
using kilotwin::testing::Dice;

namespace test_neighbours {

namespace {

using Positions = std::vector<Eigen::Vector2d>;

Positions anywhere(Dice &dice, size_t count, double side) {
    Positions out;
    for (size_t i = 0; i < count; i++)
        out.emplace_back(dice.between(0, side), dice.between(0, side));
    return out;
}

std::vector<uint32_t> list_of(const Neighbours &neighbours, uint32_t robot) {
    auto list = neighbours.of(robot);
    return {list.begin(), list.end()};
}

std::vector<uint32_t> brute_force(const Positions &positions, uint32_t robot, double width) {
    std::vector<uint32_t> out;
    for (uint32_t other = 0; other < positions.size(); other++)
        if (other != robot && (positions[other] - positions[robot]).norm() <= width)
            out.push_back(other);
    return out;
}

}  // namespace

TEST_CASE("lists hold exactly those within reach and skin, in ascending order") {
    for (uint64_t seed = 1; seed <= 20; seed++) {
        Dice dice(seed);
        double side = seed % 2 ? 3 : 40;
        auto positions = anywhere(dice, 5 + dice.below(200), side);
        double reach = dice.between(0.1, 1), skin = dice.between(0, 0.5);
        Team team(static_cast<uint32_t>(1 + seed % 4), nullptr);
        Neighbours neighbours(reach, skin, team);
        for (int rebuilds = 0; rebuilds < 2; rebuilds++) {
            neighbours.rebuild(positions);
            for (uint32_t i = 0; i < positions.size(); i++)
                CHECK(list_of(neighbours, i) == brute_force(positions, i, reach + skin));
            for (auto &p : positions)
                p += Eigen::Vector2d(dice.between(-0.1, 0.1), dice.between(-0.1, 0.1));
        }
    }
}

TEST_CASE("a robot at exactly reach and skin is on the list") {
    Team team(3, nullptr);
    Neighbours neighbours(0.75, 0.25, team);
    neighbours.rebuild(Positions{{0, 0}, {1, 0}, {0, 1.0000001}});
    CHECK(list_of(neighbours, 0) == std::vector<uint32_t>{1});
}

TEST_CASE("a rebuild reports the lists that it changed") {
    Dice dice(3);
    Team team(3, nullptr);
    Neighbours neighbours(0.5, 0.2, team);
    auto positions = anywhere(dice, 150, 6);
    neighbours.rebuild(positions);
    for (uint32_t i = 0; i < positions.size(); i++) CHECK(neighbours.changed(i));
    neighbours.rebuild(positions);
    for (uint32_t i = 0; i < positions.size(); i++) CHECK_FALSE(neighbours.changed(i));

    auto before = positions;
    size_t changed = 0;
    for (uint32_t i = 0; i < 10; i++) positions[i * 15] += Eigen::Vector2d(0.3, 0.1);
    neighbours.rebuild(positions);
    for (uint32_t i = 0; i < positions.size(); i++) {
        bool expected = brute_force(before, i, 0.7) != brute_force(positions, i, 0.7);
        CHECK(neighbours.changed(i) == expected);
        changed += expected;
    }
    CHECK(changed > 10);
    CHECK(changed < positions.size());
}

TEST_CASE("lists and what changed do not depend on how many members a team has") {
    Dice dice(9);
    auto positions = anywhere(dice, 400, 8);
    Team alone;
    Neighbours one(0.5, 0.2, alone);
    std::vector<std::unique_ptr<Team>> teams;
    std::vector<Neighbours> several;
    for (const uint32_t members : {2u, 3u, 8u}) {
        teams.push_back(std::make_unique<Team>(members, nullptr));
        several.emplace_back(0.5, 0.2, *teams.back());
    }
    for (int rebuilds = 0; rebuilds < 3; rebuilds++) {
        one.rebuild(positions);
        for (Neighbours &other : several) {
            other.rebuild(positions);
            for (uint32_t i = 0; i < positions.size(); i++) {
                CHECK(list_of(other, i) == list_of(one, i));
                CHECK(other.changed(i) == one.changed(i));
            }
        }
        // Half of them crowd in one corner, so that most cells are empty.
        for (size_t i = 0; i < positions.size(); i++)
            if (i % 2 == 0) positions[i] *= 0.6;
    }
}

TEST_CASE("robots in one point, in one line and alone are listed") {
    Team team(3, nullptr);
    Neighbours neighbours(1, 0, team);
    neighbours.rebuild(Positions(5, {2, 2}));
    CHECK(list_of(neighbours, 2) == std::vector<uint32_t>{0, 1, 3, 4});
    neighbours.rebuild(Positions{{0, 0}, {0, 1}, {0, 2}, {0, 500}});
    CHECK(list_of(neighbours, 1) == std::vector<uint32_t>{0, 2});
    CHECK(list_of(neighbours, 3).empty());
    neighbours.rebuild(Positions{{7, 7}});
    CHECK(list_of(neighbours, 0).empty());
}

}  // namespace test_neighbours
