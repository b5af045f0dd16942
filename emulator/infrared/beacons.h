/// Beacons: transmitters in objects that send one message again and again, so that robots can find
/// the object.
///
/// A beacon sends from its object's own (0, 0), by a clock of its own. On the Kilobots' channel it
/// is a station as a robot is: it does not send while it receives, listens before it sends, and
/// tries again in the next tick where it finds the channel busy; its frames collide, and are lost.
/// It makes nothing of what it receives.
///
/// When each is to begin its next frame is known, so that robots are run ahead up to there.
#ifndef KILOTWIN_INFRARED_BEACONS_H
#define KILOTWIN_INFRARED_BEACONS_H

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/chance.h"
#include "infrared/ideal_channel.h"
#include "infrared/kilobot_channel.h"
#include "infrared/station.h"
#include "message.h"

namespace kilotwin {

/// One beacon.
struct BeaconDef {
    uint32_t object;    ///< index
    message_t message;  ///< with its CRC
    Cycles period;      ///< from the begin of a frame to that of the next, above FRAME_CYCLES
};

/// All beacons of a run, whatever the medium. They begin at a random moment within their period.
class Beacons : public Stations {
  public:
    /// `bodies` must live on; `range_m`: how far they are received.
    Beacons(const std::vector<BeaconDef> &beacons, double range_m, const Bodies &bodies,
            const Chance &chance);

    /// Draws when each begins, from `until` on: before, there is no light.
    void boot(Cycles until) override;
    Cycles next_turn() const override { return next_light(); }
    Cycles next_light() const override;
    double range_m(uint32_t /*station*/) const override { return range_m_; }
    bool begins_near(uint32_t robot, Cycles until) const override;

    /// Calls `visit(robot, distance_m)` for the robots in range of a beacon, ascending; walls that
    /// block light hide some. Time O(robots).
    template <typename Visit> void for_each_receiver(uint32_t beacon, Visit visit) const {
        const Eigen::Vector2d here = place(beacon);
        for (uint32_t robot = 0; robot < bodies_.size(); robot++) {
            const Eigen::Vector2d &there = bodies_.position(robot);
            const double square = (there - here).squaredNorm();
            if (square <= range_m_ * range_m_ && bodies_.arena().lets_light_pass(here, there))
                visit(robot, std::sqrt(square));
        }
    }

  protected:
    struct Beacon {
        BeaconDef def;
        Cycles next;  ///< when it is to begin a frame
    };
    /// Where it is now, in m: its object's own (0, 0).
    Eigen::Vector2d place(uint32_t beacon) const {
        return bodies_.object_pose(beacons_[beacon].def.object).position;
    }
    /// The beacon that is to send first, if that is before `until`; else none.
    Beacon *due(Cycles until);

    std::vector<Beacon> beacons_;  ///< in the order of their objects
    double range_m_;
    const Bodies &bodies_;

  private:
    const Chance &chance_;
};

/// Beside the ideal channel: robots in range receive all frames; other robots do not hide them.
class IdealBeacons final : public Beacons {
  public:
    IdealBeacons(const std::vector<BeaconDef> &beacons, double range_m, IdealChannel &channel,
                 const Chance &chance)
        : Beacons(beacons, range_m, channel.bodies(), chance),
          channel_(channel) {}

    /// Delivers the next frame that begins before `next`.
    bool run(Cycles turn, Cycles next) override;

  private:
    IdealChannel &channel_;
};

/// On the Kilobots' channel.
class KilobotBeacons final : public Beacons {
  public:
    /// The first beacon is station `first`.
    KilobotBeacons(const std::vector<BeaconDef> &beacons, double range_m, KilobotChannel &channel,
                   const Bodies &bodies, const Chance &chance, uint32_t first)
        : Beacons(beacons, range_m, bodies, chance),
          channel_(channel),
          first_(first) {}

    /// Begins the next frame.
    bool run(Cycles turn, Cycles next) override;
    /// Reaches the robots in range.
    void shine(Frame &frame) override;
    /// Light on a beacon, which listens before it sends.
    void shine_from_robot(Frame &frame, const Eigen::Vector2d &from) override;
    /// Tries again a tick later.
    void gave_up(const Frame &frame) override;
    /// Counts it as a robot's is counted.
    void sent(const Frame &frame) override;

  private:
    KilobotChannel &channel_;
    uint32_t first_;  ///< station of the first beacon
};

}  // namespace kilotwin

#endif
