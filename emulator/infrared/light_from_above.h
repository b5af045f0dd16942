/// Overhead controllers as stations of the Kilobots' channel: light on the robots that each covers,
/// from above.
///
/// They do not listen before they send (hardware.md 1.11), so that their frames collide with
/// robots' and with one another's at each receiver, are missed by robots that send, and make robots
/// put off sending as any light does. Cells of a grid do not see them. The host says what they
/// send, and when.
#ifndef KILOTWIN_INFRARED_LIGHT_FROM_ABOVE_H
#define KILOTWIN_INFRARED_LIGHT_FROM_ABOVE_H

#include <deque>
#include <vector>

#include "infrared/station.h"
#include "message.h"

namespace kilotwin {

class KilobotChannel;

/// One per Kilobot channel: as many stations as there are controllers, behind all others. Time
/// O(robots) per frame.
class LightFromAbove final : public Stations {
  public:
    /// `channel` must live on. Stations from `first` on are these.
    LightFromAbove(KilobotChannel &channel, uint32_t first, uint32_t controllers)
        : channel_(channel),
          first_(first),
          controllers_(controllers) {}

    /// A frame of a controller is to begin at `at`; later, if the one before is still on air then.
    void add(const message_t &message, Cycles at, uint32_t controller);

    /// When the next frame begins that has not begun; NEVER without one.
    Cycles next() const { return controllers_[soonest()].next(); }

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
    struct Controller {
        std::deque<Waiting> waiting = {};  ///< frames that have not begun, in order of time
        Cycles free_at = 0;                ///< when the last one that has begun is over

        Cycles next() const;  ///< NEVER without one
    };

    size_t soonest() const;  ///< the controller that begins next, the first of several

    KilobotChannel &channel_;
    uint32_t first_;
    std::vector<Controller> controllers_;  ///< one at least
    uint64_t begun_ = 0;                   ///< so many frames have
};

}  // namespace kilotwin

#endif
