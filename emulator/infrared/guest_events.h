/// Requests of guests and begins of their planned frames, in order of time.
#ifndef KILOTWIN_INFRARED_GUEST_EVENTS_H
#define KILOTWIN_INFRARED_GUEST_EVENTS_H

#include <cstddef>
#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

#include "base/clock.h"
#include "base/selection.h"

namespace kilotwin {

/// A robot is asked, or a frame that it has planned for this step begins.
struct GuestEvent {
    static constexpr uint32_t NONE = UINT32_MAX;

    Cycles at;
    uint32_t robot;
    uint32_t frame = NONE;  ///< which of the step's planned frames begins; NONE: it is a request

    bool is_request() const { return frame == NONE; }
    /// Begins of frames come before requests at the same time, then the lower robot comes first.
    bool operator>(const GuestEvent &other) const {
        if (at != other.at) return at > other.at;
        return is_request() != other.is_request() ? is_request() : robot > other.robot;
    }
};

/// Those of one step are sorted when it begins. What comes later goes to their end where it is the
/// last, as most is.
class GuestEvents {
  public:
    /// A step begins: forgets the events of the last, which were taken. Those that were scheduled
    /// for later stay.
    void clear() {
        events_.clear();
        next_ = 0;
    }

    /// Adds an event in any order, before sort().
    void add(const GuestEvent &event) { events_.push_back(event); }

    /// Sorts those added, in the step that begins at `begin` and lasts `step`.
    void sort(Cycles begin, Cycles step) {
        sorter_.sort(
            events_, begin, step, [](const GuestEvent &event) { return event.at; },
            [](const GuestEvent &a, const GuestEvent &b) { return b > a; });
    }

    /// Adds an event of this step, which lasts until `end`, or of a later one.
    void schedule(const GuestEvent &event, Cycles end) {
        if (event.at < end && (events_.empty() || event > events_.back()))
            events_.push_back(event);
        else
            others_.push(event);
    }

    /// The first; null without one.
    const GuestEvent *first() const {
        const GuestEvent *first = next_ < events_.size() ? &events_[next_] : nullptr;
        if (!others_.empty() && (first == nullptr || *first > others_.top()))
            first = &others_.top();
        return first;
    }

    /// Takes first() out.
    GuestEvent take() {
        const GuestEvent event = *first();
        if (next_ < events_.size() && !(events_[next_] > event))
            next_++;
        else
            others_.pop();
        return event;
    }

    /// The event that comes so many turns after the first, but for those that came late; null
    /// behind the last.
    const GuestEvent *later(size_t turns) const {
        return next_ + turns < events_.size() ? &events_[next_ + turns] : nullptr;
    }

    /// Between two steps: moves those scheduled for later to `to`, and puts one back.
    void move_later(std::vector<GuestEvent> &to) {
        for (; !others_.empty(); others_.pop()) to.push_back(others_.top());
    }
    void put_back(const GuestEvent &event) { others_.push(event); }

  private:
    std::vector<GuestEvent> events_;  ///< of this step, those from next_ on to come
    size_t next_ = 0;
    std::priority_queue<GuestEvent, std::vector<GuestEvent>, std::greater<>> others_;
    StepSorter<GuestEvent> sorter_;
};

}  // namespace kilotwin

#endif
