/// Ends of carrier-sense windows or of frames, in order of time.
#ifndef KILOTWIN_INFRARED_FRAME_ENDS_H
#define KILOTWIN_INFRARED_FRAME_ENDS_H

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// The end of a window, or of a frame.
struct End {
    Cycles at;
    uint32_t sender;
    bool operator>(const End &other) const {
        return at != other.at ? at > other.at : sender > other.sender;
    }
};

/// A queue to which most come in order: windows have one length, and so have frames.
class Ends {
  public:
    /// Time O(1) where it is the last, as most are.
    void push(const End &end) {
        ends_.push_back(end);
        for (size_t i = ends_.size() - 1; i > first_ && ends_[i - 1] > ends_[i]; i--)
            std::swap(ends_[i - 1], ends_[i]);
    }

    /// Takes the first out. Taken items stay in front until they are half of the list.
    void pop() {
        if (2 * ++first_ < ends_.size()) return;
        ends_.erase(ends_.begin(), ends_.begin() + static_cast<ptrdiff_t>(first_));
        first_ = 0;
    }

    /// When the first is due, NEVER without one; and its sender.
    Cycles next() const { return first_ < ends_.size() ? ends_[first_].at : NEVER; }
    uint32_t sender() const { return ends_[first_].sender; }

    /// How many there are.
    size_t size() const { return ends_.size() - first_; }
    /// The sender of the one that comes so many turns after the first; below size().
    uint32_t sender(size_t turns) const { return ends_[first_ + turns].sender; }

    /// Moves those whose sender is not `wanted` to the end of `others`.
    template <typename Wanted> void keep(Wanted wanted, std::vector<End> &others) {
        size_t kept = first_;
        for (size_t i = first_; i < ends_.size(); i++) {
            if (wanted(ends_[i].sender))
                ends_[kept++] = ends_[i];
            else
                others.push_back(ends_[i]);
        }
        ends_.resize(kept);
    }

  private:
    std::vector<End> ends_;  ///< from first_ on
    size_t first_ = 0;
};

}  // namespace kilotwin

#endif
