/// Two normal draws side by side, in the two lanes of an SSE2 register: what motor noise and the
/// two gains of a reception need. Brings 2 % of `walk` on the Kilobot medium (docs/performance.md).
/// Chance::normal() is its plain twin, and the oracle of test_normal_pairs.
#ifndef KILOTWIN_BASE_NORMAL_PAIRS_H
#define KILOTWIN_BASE_NORMAL_PAIRS_H

#include <array>
#include <cstdint>

#include "base/chance.h"

namespace kilotwin {

/// Draws of one seed. Without state, as Chance, so that any number of users may share one object.
/// 320 bytes where the processor has SSE2, as each x86-64 has; elsewhere it calls Chance twice.
class NormalPairs {
  public:
    /// Draws of the same seed as `chance`, which need not live on. Computes the keys of all rounds
    /// once.
    explicit NormalPairs(const Chance &chance);

    /// Chance::normal() of `robot` for both purposes, bit for bit: mean 0, variance 1, within
    /// +-4.9. n from 0, the same for both. The two may be equal. Costs little more than one draw.
    std::array<double, 2> draw(uint32_t robot, std::array<Purpose, 2> purposes, uint64_t n) const;

  private:
#ifdef __SSE2__
    /// The keys of one of Philox' ten rounds, twice each: one for each lane. A word is the lower
    /// half of its lane: the product of two words takes the whole lane.
    struct alignas(16) RoundKeys {
        uint64_t a[2], b[2];
    };
    std::array<RoundKeys, 10> round_keys_;
#else
    Chance chance_;
#endif
};

}  // namespace kilotwin

#endif
