// The worst that can happen to bodies: a hundred robots that all drive to one spot.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/trigonometry.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace {

/// 100 robots that drive straight to `spot` for 300 s, with all their force.
void drive_into(const std::string &name, const Arena &arena, const Eigen::Vector2d &spot,
                uint32_t step_ticks) {
    Scene scene(arena, 3);
    scene.def.step_ticks = step_ticks;
    scene.add_anywhere("puppet", 100);
    Samples start = Simulation(scene.def).snapshot();
    std::vector<Pose> poses;
    for (uint32_t i = 0; i < 100; i++) {
        Pose pose = pose_of(start, i);
        pose.heading = std::atan2(spot.y() - pose.position.y(), spot.x() - pose.position.x());
        poses.push_back(pose);
    }
    scene.def.groups[0].poses = poses;
    scene.tell_all(0, message(MOTORS, {FULL, FULL}));
    Simulation simulation(scene.def);
    simulation.advance(static_cast<int64_t>(std::lround(300 / TICK_S)));

    const auto &overlaps = simulation.statistics().overlaps;
    MESSAGE(name << ", steps of " << step_ticks << " ticks: overlap worst "
                 << 100 * overlaps.worst() << " %, median " << 100 * overlaps.median()
                 << " % of a diameter over " << overlaps.contacts() << " contacts");
    CHECK(overlaps.contacts() > 10'000);
    CHECK(overlaps.worst() <= 0.05);
    CHECK(overlaps.median() <= 0.01);

    // They are all there, none in a wall, and packed as discs can be.
    auto end = simulation.snapshot();
    for (uint32_t i = 0; i < 100; i++) {
        CHECK(arena.wall_gap(pose_of(end, i).position) > 0.95 * 0.085);
        for (uint32_t j = 0; j < i; j++)
            CHECK((pose_of(end, i).position - pose_of(end, j).position).norm() > 0.95 * 0.17);
    }
}

}  // namespace

TEST_CASE("a hundred robots driven into the middle of the arena overlap by little") {
    for (uint32_t step : {1u, 2u, 4u}) drive_into("middle", round_hall(8), {0, 0}, step);
}

TEST_CASE("a hundred robots driven into a corner overlap by little") {
    drive_into("corner", square_hall(6), {3, 3}, 2);
}

TEST_CASE("a hundred robots driven against one spot of a round wall overlap by little") {
    drive_into("round wall", round_hall(8), {4, 0}, 2);
}
