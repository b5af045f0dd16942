#include "infrared/tentative_runs.h"

#include <algorithm>

namespace kilotwin {

bool TentativeRuns::begin(uint32_t robot, Cycles now, Cycles limit) {
    std::call_once(begun_, [this] { runs_.resize(robots_.size()); });
    Run &run = runs_[robot];
    Robot &guest = robots_[robot];
    if (!guest.can_restore()) return false;
    if (run.pause > 0) {
        run.pause--;
        return false;
    }
    if (run.saved)
        guest.save(*run.saved);
    else
        run.saved = std::make_unique<Robot::Saved>(guest);
    const Cycles until = std::min(limit, now + run.steps * step_);
    if (!guest.run_tentatively(until, *run.saved)) {
        run.pause = PAUSE;
        return false;
    }
    run.due = has_message(robot) ? guest.now() : until;
    return true;
}

void TentativeRuns::end(uint32_t robot) {
    Run &run = runs_[robot];
    run.steps = std::min<uint8_t>(MOST_STEPS, 2 * run.steps);
}

void TentativeRuns::bring_back(uint32_t robot, Cycles at) {
    Run &run = runs_[robot];
    run.steps = std::max<uint8_t>(1, run.steps / 2);
    robots_[robot].bring_back(*run.saved, at);
}

void TentativeRuns::go_on(uint32_t robot, Cycles until) {
    robots_[robot].run_in_the_dark(until);
    robots_[robot].motor_commands().clear();
}

}  // namespace kilotwin
