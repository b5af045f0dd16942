/// Samples of what can be seen of robots and objects, and the numbers that a run adds up.
#ifndef KILOTWIN_SIMULATION_RECORDER_H
#define KILOTWIN_SIMULATION_RECORDER_H

#include <cstdint>
#include <vector>

#include "physics/motion.h"

namespace kilotwin {

/// Row by row: one moment after the other, robots in order within each, and objects likewise.
struct Samples {
    std::vector<int64_t> tick;                                      ///< nominal ticks since RUN
    std::vector<float> x_m, y_m, heading_rad;                       ///< poses
    std::vector<uint8_t> led;                                       ///< RGB()
    std::vector<uint8_t> site;                                      ///< under the centre, 0 none
    std::vector<float> object_x_m, object_y_m, object_heading_rad;  ///< poses of their own frames

    /// Appends a robot to the sample begun last; `tick` is the caller's.
    void add_robot(const Pose &pose, uint8_t color, uint8_t site_under);
    /// The same for an object.
    void add_object(const Pose &pose);
};

}  // namespace kilotwin

#endif
