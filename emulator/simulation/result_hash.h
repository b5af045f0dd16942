/// "Same result" as a number: two runs whose hashes are equal did the same at every sample.
#ifndef KILOTWIN_SIMULATION_RESULT_HASH_H
#define KILOTWIN_SIMULATION_RESULT_HASH_H

#include <cstdint>
#include <vector>

#include "base/events.h"
#include "infrared/channel.h"
#include "simulation/recorder.h"

namespace kilotwin {

/// FNV-1a over poses as float32 and LEDs of one sample, in robot order, and poses of objects.
uint64_t final_hash(const Samples &now);

/// Adds up a run: every sample (tick, poses, LEDs, sites, objects), prints and failures, and at the
/// end the counts of frames. It does not depend on how often samples and events are fetched. Notes
/// and warnings of waits are left out, since they are about programs and not about what robots did.
/// Cost: some 5 ns for a robot's sample.
class ResultHash {
  public:
    /// Takes the last moment of `samples`, which has all robots and objects in each.
    void take(const Samples &samples);

    /// Takes events in any order. `zero`: when t = 0 is.
    void take(const Events &events, Cycles zero);

    /// With the last moment and the counts; the sums stay as they are.
    uint64_t value(const Samples &now, const ChannelCounts &counts,
                   const std::vector<FrameCounts> &frames) const;

  private:
    uint64_t samples_ = 0;
    uint64_t events_ = 0;  ///< sum: their order does not matter
};

}  // namespace kilotwin

#endif
