/// Robots that are run ahead tentatively: as if no light reached them.
///
/// Whether light reaches a robot is known only when all others have been executed up to there. One
/// that is asked for a message at each tick and has none would have to be executed tick by tick,
/// and so would those around it. Instead it is copied, and run on through many steps or up to its
/// next message. Mostly that comes true. If light reaches it before, it is brought back to the copy
/// and executed again up to there: the result is that of the order of time, bit for bit.
///
/// How far each is run is learned from how that went; it changes the cost alone.
#ifndef KILOTWIN_INFRARED_TENTATIVE_RUNS_H
#define KILOTWIN_INFRARED_TENTATIVE_RUNS_H

#include <memory>
#include <mutex>
#include <vector>

#include "base/clock.h"
#include "base/memory.h"
#include "robots/robot.h"

namespace kilotwin {

class TentativeRuns {
  public:
    /// Runs guests among `robots`, which must live on, in world steps of `step`.
    TentativeRuns(Swarm<Robot> &robots, Cycles step) : robots_(robots), step_(step) {}

    /// Runs a robot on, in the step that begins at `now`, not beyond `limit`. False if that cannot
    /// be undone, or was so the last times: it is as before.
    bool begin(uint32_t robot, Cycles now, Cycles limit);

    /// During a run: whether it ended with a message that the robot wants to send.
    bool has_message(uint32_t robot) const {
        return robots_[robot].question() != Robot::Question::NONE;
    }
    /// During a run: the moment of that message, or up to which the robot was run, a begin of a
    /// step.
    Cycles due(uint32_t robot) const { return runs_[robot].due; }

    /// A run is over, and was right.
    void end(uint32_t robot);

    /// A run is over: light reaches the robot at `at`, and it is executed up to there alone.
    void bring_back(uint32_t robot, Cycles at);
    /// It is executed up to `until` after all.
    void go_on(uint32_t robot, Cycles until);

  private:
    struct Run {
        Cycles due = 0;
        uint8_t steps = 1;  ///< so long is the next one
        uint8_t pause = 0;  ///< so many times it is not tried
        std::unique_ptr<Robot::Saved> saved;
    };
    static constexpr uint8_t MOST_STEPS = 64, PAUSE = 200;

    Swarm<Robot> &robots_;
    Cycles step_;
    std::vector<Run> runs_;  ///< by robot, once there was one
    std::once_flag begun_;   ///< there was; members of a team may begin at once
};

}  // namespace kilotwin

#endif
