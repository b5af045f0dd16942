// Prefetching changes the cost of a run, never its result: a run without is the oracle.
#include <doctest/doctest.h>

#include <cstdint>

#include "base/prefetch.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_prefetch {

namespace {

/// Sets the size from which on swarms are prefetched, until the end of its life.
class PrefetchedSwarm {
  public:
    explicit PrefetchedSwarm(size_t robots) : before_(prefetched_swarm) {
        prefetched_swarm = robots;
    }
    ~PrefetchedSwarm() { prefetched_swarm = before_; }

  private:
    size_t before_;
};

/// Hash of 200 walkers with all noise on, crowded enough to touch and to collide on the air.
uint64_t hash_with(size_t prefetched_from, bool kilobot_medium) {
    const PrefetchedSwarm guard(prefetched_from);
    Scene scene(square_hall(1), 7);
    scene.def.profile = small_robot();
    scene.def.profile.speed_m_s = 0.013;
    scene.def.profile.legs = true;
    scene.def.profile.speed_spread = 0.08;
    scene.def.profile.motor_noise = 0.2;
    scene.def.range_m = 0.1;
    if (kilobot_medium) scene.def.kilobot_medium = infrared_settings();
    scene.add_anywhere("wanderer", 200);
    Simulation simulation(scene.def);
    simulation.advance(800);
    CHECK(simulation.statistics().solver_steps > 0);
    CHECK(simulation.statistics().medium.received > 0);
    return final_hash(simulation.snapshot());
}

}  // namespace

TEST_CASE("a swarm that is prefetched ends where the same swarm does that is not") {
    for (bool kilobot_medium : {false, true})
        CHECK(hash_with(0, kilobot_medium) == hash_with(SIZE_MAX, kilobot_medium));
}

TEST_CASE("large swarms are prefetched and small ones are not") {
    CHECK(prefetches(10'000));
    CHECK_FALSE(prefetches(1'000));
}

}  // namespace test_prefetch
