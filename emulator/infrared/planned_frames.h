/// Frames that robots which were run ahead send later, by the step in which they begin.
#ifndef KILOTWIN_INFRARED_PLANNED_FRAMES_H
#define KILOTWIN_INFRARED_PLANNED_FRAMES_H

#include <array>
#include <cstddef>
#include <vector>

#include "base/clock.h"
#include "guest/robot.h"

namespace kilotwin {

/// A frame, and what its sender does after it.
struct PlannedFrame {
    Emission emission;  ///< begin, sender, message
    Cycles next;        ///< nothing more comes from its sender before
};

/// A ring of steps.
class PlannedFrames {
  public:
    static constexpr size_t STEPS = 64;  ///< a frame begins less than so many steps ahead

    /// Those of the step in which `at` lies.
    std::vector<PlannedFrame> &at(Cycles at, Cycles step) {
        return steps_[number_of_step(at, step) % STEPS];
    }

  private:
    std::array<std::vector<PlannedFrame>, STEPS> steps_;  ///< by number of step
};

}  // namespace kilotwin

#endif
