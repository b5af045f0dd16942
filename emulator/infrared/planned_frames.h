/// Frames that robots which were run ahead send later, by the step in which they begin.
#ifndef KILOTWIN_INFRARED_PLANNED_FRAMES_H
#define KILOTWIN_INFRARED_PLANNED_FRAMES_H

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "robots/robot.h"

namespace kilotwin {

/// A frame, and what its sender does after it.
struct PlannedFrame {
    Emission emission;  ///< begin, sender, message
    Cycles next;        ///< nothing more comes from its sender before
};

/// A ring of steps. Few of them have frames at a time, so memory goes from step to step: kept by
/// each, it would be what the fullest of its turns took, 1 KB a robot where all talk at once.
class PlannedFrames {
  public:
    static constexpr size_t STEPS = 64;  ///< a frame begins less than so many steps ahead

    /// Those of the step in which `at` lies.
    std::vector<PlannedFrame> &at(Cycles at, Cycles step) {
        std::vector<PlannedFrame> &frames = steps_[number_of_step(at, step) % STEPS];
        if (frames.capacity() == 0 && !spares_.empty()) {
            frames = std::move(spares_.back());
            spares_.pop_back();
        }
        return frames;
    }

    /// Adds a frame that begins at `at`, to be filled where it stands. Rooms grow by a quarter: of
    /// those that have doubled, up to half would stay empty, 70 bytes a robot.
    PlannedFrame &add(Cycles at, Cycles step) {
        std::vector<PlannedFrame> &frames = this->at(at, step);
        if (frames.size() == frames.capacity()) frames.reserve(frames.size() * 5 / 4 + 16);
        return frames.emplace_back();
    }

    /// Forgets those of that step.
    void forget(Cycles at, Cycles step) {
        std::vector<PlannedFrame> &frames = this->at(at, step);
        frames.clear();
        spares_.push_back(std::exchange(frames, {}));
    }

  private:
    std::array<std::vector<PlannedFrame>, STEPS> steps_;  ///< by number of step
    std::vector<std::vector<PlannedFrame>> spares_;       ///< empty ones, with their memory
};

}  // namespace kilotwin

#endif
