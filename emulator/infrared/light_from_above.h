/// An overhead controller as a station of the Kilobots' channel: light on all robots, from above.
///
/// It does not listen before it sends (hardware.md 1.11), so its frames collide with robots' at
/// each receiver, are missed by robots that send, and make robots put off sending as any light
/// does. Cells of a grid do not see it. The host says what it sends, and when.
#ifndef KILOTWIN_INFRARED_LIGHT_FROM_ABOVE_H
#define KILOTWIN_INFRARED_LIGHT_FROM_ABOVE_H

#include <deque>

#include "infrared/station.h"
#include "message.h"

namespace kilotwin {

class KilobotChannel;

/// One per Kilobot channel: one station, behind all others. Time O(robots) per frame.
class LightFromAbove final : public Stations {
  public:
    /// `channel` must live on. Station `station` is this one.
    LightFromAbove(KilobotChannel &channel, uint32_t station)
        : channel_(channel),
          station_(station) {}

    /// A frame is to begin at `at`; later, if the one before is still on air then.
    void add(const message_t &message, Cycles at);

    /// When the next frame begins that has not begun; NEVER without one.
    Cycles next() const;

    /// Starts the next frame.
    void begin_next();

    /// Any value: loss from above does not depend on the distance (RobotReceiver::is_lost()).
    double range_m(uint32_t /*station*/) const override { return 1; }
    void shine(Frame &frame) override;
    void sent(const Frame &frame) override;

  private:
    struct Waiting {
        Cycles at;  ///< when it is to begin
        message_t message;
    };

    KilobotChannel &channel_;
    uint32_t station_;
    std::deque<Waiting> waiting_;  ///< frames that have not begun, in order of time
    Cycles free_at_ = 0;           ///< when the last one that has begun is over
    uint64_t begun_ = 0;           ///< so many have
};

}  // namespace kilotwin

#endif
