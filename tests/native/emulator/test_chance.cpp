#include "base/chance.h"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <set>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_chance {

TEST_CASE("draws are those of Philox 4x32-10: the published vectors") {
    CHECK(Chance(0).bits(0, Purpose(0), 0) == 0xe169c58d6627e8d5);
    CHECK(Chance(~0ull).bits(~0u, Purpose(~0u), ~0ull) == 0x41c83b0e408f276d);
    CHECK(Chance(0x299f31d0a4093822).bits(0x13198a2e, Purpose(0x03707344), 0x85a308d3243f6a88) ==
          0x94fdccebd16cfe09);
}

TEST_CASE("purposes keep their numbers") {
    CHECK(uint32_t(Purpose::PLACE) == 1);
    CHECK(uint32_t(Purpose::HEADING) == 2);
    CHECK(uint32_t(Purpose::POWER_UP) == 3);
    CHECK(uint32_t(Purpose::RAND_HARD) == 4);
}

TEST_CASE("seeds, robots, purposes and draws all differ") {
    std::set<uint64_t> seen;
    for (uint64_t seed : {0ull, 1ull, 2ull, 1ull << 32})
        for (uint32_t robot = 0; robot < 20; robot++)
            for (auto purpose :
                 {Purpose::PLACE, Purpose::HEADING, Purpose::POWER_UP, Purpose::RAND_HARD})
                for (uint64_t n : {0ull, 1ull, 2ull, 1ull << 32})
                    CHECK(seen.insert(Chance(seed).bits(robot, purpose, n)).second);
}

TEST_CASE("uniform draws lie in [0, 1), evenly") {
    Chance chance(7);
    double sum = 0, square = 0;
    constexpr int DRAWS = 100'000;
    for (int i = 0; i < DRAWS; i++) {
        double u = chance.uniform(3, Purpose::HEADING, static_cast<uint64_t>(i));
        CHECK((u >= 0 && u < 1));
        sum += u;
        square += u * u;
    }
    CHECK(sum / DRAWS == doctest::Approx(0.5).epsilon(0.01));
    CHECK(square / DRAWS == doctest::Approx(1.0 / 3).epsilon(0.01));
}

namespace {

/// First draws of each robot of a world (`roll_call` prints four rand_hard draws), and where it
/// started.
struct Start {
    std::map<uint32_t, std::vector<std::string>> draws;
    Samples poses;
};

Start start_of(size_t robots, bool one_more_far_away) {
    Scene scene(square_hall(40), 11);
    scene.add_anywhere("roll_call", robots);
    if (one_more_far_away) scene.add("roll_call", {{{19.8, 19.8}, 0}});
    Simulation simulation(scene.def);
    Start start;
    start.poses = simulation.snapshot();
    simulation.advance(8);
    auto events = simulation.take_events();
    for (uint32_t robot = 0; robot < scene.robots; robot++)
        start.draws[robot] = texts(events, robot);
    return start;
}

}  // namespace

TEST_CASE("a 101st robot in a far corner leaves the first draws of all others as they were") {
    auto without = start_of(100, false), with = start_of(100, true);
    std::set<std::string> distinct;
    for (uint32_t robot = 0; robot < 100; robot++) {
        REQUIRE(without.draws[robot].size() == 1);
        CHECK(without.draws[robot] == with.draws[robot]);
        CHECK(without.poses.x_m[robot] == with.poses.x_m[robot]);
        CHECK(without.poses.y_m[robot] == with.poses.y_m[robot]);
        CHECK(without.poses.heading_rad[robot] == with.poses.heading_rad[robot]);
        distinct.insert(without.draws[robot][0]);
    }
    CHECK(distinct.size() == 100);
    CHECK(with.draws[100].size() == 1);
}

}  // namespace test_chance
