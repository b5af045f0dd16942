/// The earliest of a fixed number of things, each with a time: a tournament tree. Of things at the
/// same time, the one with the lowest number comes first.
#ifndef KILOTWIN_BASE_EARLIEST_H
#define KILOTWIN_BASE_EARLIEST_H

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// Leaves are the things' times; each inner node holds the earlier time of its two.
/// Used by the grid, where few of hundreds of modules are due at a time.
class Earliest {
  public:
    /// Things 0 to `count` - 1, all at NEVER. Memory is 2 times `count`, rounded up to a power of
    /// 2.
    explicit Earliest(uint32_t count)
        : leaves_(std::bit_ceil(std::max(count, 1U))),
          nodes_(2 * size_t{leaves_}, NEVER) {}

    /// The time of a thing, which is below `count`. One load.
    Cycles at(uint32_t thing) const { return nodes_[leaves_ + thing]; }

    /// Sets the time of a thing, earlier or later than it was. At most log2(count) steps, and
    /// mostly few: it ends where the earliest time does not change.
    void set(uint32_t thing, Cycles at) {
        size_t node = leaves_ + thing;
        nodes_[node] = at;
        while (node > 1) {
            const Cycles first = std::min(nodes_[node], nodes_[node ^ 1]);
            node /= 2;
            if (nodes_[node] == first) return;
            nodes_[node] = first;
        }
    }

    /// The earliest time; NEVER if no thing comes. One load.
    Cycles first_at() const { return nodes_[1]; }

    /// The thing at that time; without meaning if it is NEVER. log2(count) steps.
    uint32_t first() const {
        size_t node = 1;
        while (node < leaves_) {
            node *= 2;
            if (nodes_[node] != nodes_[1]) node++;
        }
        return static_cast<uint32_t>(node - leaves_);
    }

  private:
    uint32_t leaves_;            ///< a power of two, at least `count`
    std::vector<Cycles> nodes_;  ///< 1 is the root, children of n are 2n and 2n + 1
};

}  // namespace kilotwin

#endif
