/// Carrier sense of the Kilobot's infrared: what a sender notices of other light (hardware.md 1.6).
///
/// An attempt begins with the start pulse of its leader. Between that and the leader's stop pulse
/// the sender polls its receiver; light seen then makes the attempt fail.
#ifndef KILOTWIN_INFRARED_CARRIER_SENSE_H
#define KILOTWIN_INFRARED_CARRIER_SENSE_H

#include "base/clock.h"
#include "infrared/frames_in_flight.h"
#include "kilolib/core/infrared_frame.h"

namespace kilotwin {

/// One per Kilobot channel, for stations of all kinds. Without state of its own.
class CarrierSense {
  public:
    /// The window, from the begin of the attempt.
    static constexpr Cycles WINDOW_BEGIN = LEADER_REST_SLOTS * SLOT_CYCLES,
                            WINDOW_END = WINDOW_BEGIN + LEADER_POLLS * POLL_CYCLES;

    /// Without `senses` an attempt never fails, with `held_busy` always does. `frames` must live
    /// on.
    CarrierSense(bool senses, bool held_busy, const FramesInFlight &frames)
        : senses_(senses),
          held_busy_(held_busy),
          frames_(frames) {}

    /// Result of the attempt `frame`, when its window is over. Light on the receiver while it
    /// polled: the start pulse of a frame begun meanwhile, or the leader's stop pulse of one that
    /// began too shortly before its own to be noticed. Time O(frames audible).
    bool finds_busy(const Frame &frame) const;

    /// Whether a frame that `station` has noticed is arriving at `at`: then its program is not
    /// asked for a message.
    bool is_receiving(uint32_t station, Cycles at) const;

    /// Whether `station` may find the channel busy for what is on air now, or held busy.
    bool may_be_busy(uint32_t station) const {
        return held_busy_ || !frames_.is_dark(station) || frames_.is_on_air(station);
    }

    /// The settings that it was made with.
    bool senses() const { return senses_; }
    bool held_busy() const { return held_busy_; }

  private:
    bool senses_, held_busy_;
    const FramesInFlight &frames_;
};

}  // namespace kilotwin

#endif
