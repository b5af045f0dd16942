/// Events that robots meet at given times: messages from outside the channel ([[command]] and the
/// orders of tests), and failures ([[faults.robot]]).
#ifndef KILOTWIN_SIMULATION_COMMANDS_H
#define KILOTWIN_SIMULATION_COMMANDS_H

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "message.h"

namespace kilotwin {

/// A message to all robots with a uid in the range, without loss and without air time.
struct Command {
    int64_t tick;  ///< since RUN; negative: before
    uint16_t uid_first, uid_last;
    message_t message;
    /// Only robots whose centre is in here when it is sent, m; infinite: everywhere.
    Eigen::Vector2d centre{0, 0};
    double radius_m = INFINITY;

    /// Whether the range of uids has it; where the robot is does not matter.
    bool is_for(uint16_t uid) const { return uid >= uid_first && uid <= uid_last; }
    bool is_everywhere() const { return !(radius_m < INFINITY); }
};

/// The failure of a robot.
struct RobotFault {
    enum class Kind {
        DEAD,       ///< it stops for good: LED and motors off, silent
        DEAF,       ///< nothing that anybody sends it is received
        RECEIVES,   ///< it is deaf no more
        MUTE,       ///< nothing that it sends is received
        TRANSMITS,  ///< it is mute no more
        MOTORS      ///< their speeds are multiplied for good
    };
    int64_t tick;  ///< since RUN; it comes with the next world step
    uint32_t robot;
    Kind kind;
    double left, right;  ///< of the motors: 0 and 0 for one that is stuck
};

/// Those that wait for their time. Of the same tick, the first given is the first.
template <typename Timed> class Schedule {
  public:
    /// Ticks count from `run_at`.
    Schedule(std::vector<Timed> all, Cycles run_at) : all_(std::move(all)), run_at_(run_at) {
        std::stable_sort(all_.begin(), all_.end(),
                         [](const auto &a, const auto &b) { return a.tick < b.tick; });
    }

    /// When the next one is due; NEVER if there is none.
    Cycles next_at() const { return next_ < all_.size() ? time_of(all_[next_]) : NEVER; }

    /// Calls give(it, its time) for all that are due before `until`.
    template <typename Give> void take(Cycles until, Give give) {
        for (; next_at() < until; next_++) give(all_[next_], next_at());
    }

  private:
    Cycles time_of(const Timed &one) const {
        return run_at_ + static_cast<Cycles>(one.tick) * TICK_CYCLES;  // negative ticks wrap
    }

    std::vector<Timed> all_;  ///< by tick
    Cycles run_at_;
    size_t next_ = 0;  ///< those before it have been taken
};

}  // namespace kilotwin

#endif
