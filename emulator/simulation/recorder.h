/// Samples of what can be seen of the robots, and the numbers that a run adds up.
#ifndef KILOTWIN_SIMULATION_RECORDER_H
#define KILOTWIN_SIMULATION_RECORDER_H

#include <cstdint>
#include <vector>

#include "physics/motion.h"

namespace kilotwin {

/// Row by row: one moment after the other, robots in order within each.
struct Samples {
    std::vector<int64_t> tick;                 ///< nominal ticks since RUN
    std::vector<float> x_m, y_m, heading_rad;  ///< poses
    std::vector<uint8_t> led;                  ///< RGB()
    std::vector<uint8_t> site;                 ///< under the centre, 0 none

    /// Appends a robot to the sample begun last; `tick` is the caller's.
    void add_robot(const Pose &pose, uint8_t color, uint8_t site_under);
};

}  // namespace kilotwin

#endif
