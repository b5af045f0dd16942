/// Which of so many things comes first; of those at the same time, the one with the lowest number.
#ifndef KILOTWIN_BASE_EARLIEST_H
#define KILOTWIN_BASE_EARLIEST_H

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// A tree whose leaves are the things' times; each node above holds the earlier of its two.
class Earliest {
  public:
    /// Things 0 to `count` - 1, all at NEVER.
    explicit Earliest(uint32_t count)
        : leaves_(std::bit_ceil(std::max(count, 1U))),
          nodes_(2 * size_t{leaves_}, NEVER) {}

    Cycles at(uint32_t thing) const { return nodes_[leaves_ + thing]; }

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

    /// When the first one comes.
    Cycles first_at() const { return nodes_[1]; }

    /// Which one it is; without meaning if none comes.
    uint32_t first() const {
        size_t node = 1;
        while (node < leaves_) {
            node *= 2;
            if (nodes_[node] != nodes_[1]) node++;
        }
        return static_cast<uint32_t>(node - leaves_);
    }

  private:
    uint32_t leaves_;
    std::vector<Cycles> nodes_;
};

}  // namespace kilotwin

#endif
