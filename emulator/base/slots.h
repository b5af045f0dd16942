/// Slots: where robots are kept inside the engine.
///
/// An experiment knows a robot by its index. The engine keeps large swarms by place, so that robots
/// near each other on the table are near each other in memory, and in one share (base/team.h): all
/// lists by robot in bodies and channels have one entry for each slot. Draws, events and whatever
/// else leaves the engine go by index, so that the order of slots changes no result, but for the
/// last bits of islands of contacts, which solve theirs one after the other, and for frames that
/// begin in the same cycle.
#ifndef KILOTWIN_BASE_SLOTS_H
#define KILOTWIN_BASE_SLOTS_H

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace kilotwin {

class Slots {
  public:
    /// Each of so many robots has the slot of its index.
    explicit Slots(size_t robots) : Slots(in_order(robots)) {}

    /// The robots with these indices, each below their number and there once, in slots 0, 1, ...
    explicit Slots(std::vector<uint32_t> index_in)
        : index_in_(std::move(index_in)),
          slot_of_(index_in_.size()) {
        for (uint32_t slot = 0; slot < size(); slot++) slot_of_[index_in_[slot]] = slot;
    }

    /// How many robots there are.
    size_t size() const { return index_in_.size(); }
    uint32_t index_in(uint32_t slot) const { return index_in_[slot]; }
    uint32_t slot_of(uint32_t index) const { return slot_of_[index]; }

  private:
    static std::vector<uint32_t> in_order(size_t robots) {
        std::vector<uint32_t> all(robots);
        std::iota(all.begin(), all.end(), 0u);
        return all;
    }

    std::vector<uint32_t> index_in_, slot_of_;
};

}  // namespace kilotwin

#endif
