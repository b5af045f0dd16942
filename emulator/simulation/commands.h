/// Messages from outside the channel, in order of time: [[command]] and the orders of tests.
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

/// Commands that wait for their time. Of those of the same tick, the first given is the first sent.
class Commands {
  public:
    /// Ticks count from `run_at`.
    Commands(std::vector<Command> commands, Cycles run_at)
        : commands_(std::move(commands)),
          run_at_(run_at) {
        std::stable_sort(commands_.begin(), commands_.end(),
                         [](const auto &a, const auto &b) { return a.tick < b.tick; });
    }

    /// When the next one is due; NEVER if there is none.
    Cycles next_at() const { return next_ < commands_.size() ? time_of(commands_[next_]) : NEVER; }

    /// Calls give(command, its time) for all that are due before `until`.
    template <typename Give> void take(Cycles until, Give give) {
        for (; next_at() < until; next_++) give(commands_[next_], next_at());
    }

  private:
    Cycles time_of(const Command &command) const {
        return run_at_ + static_cast<Cycles>(command.tick) * TICK_CYCLES;  // negative ticks wrap
    }

    std::vector<Command> commands_;  ///< by tick
    Cycles run_at_;
    size_t next_ = 0;  ///< those before it have been taken
};

}  // namespace kilotwin

#endif
