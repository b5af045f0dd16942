/// Samples of what can be seen of robots and objects, and the numbers that a run adds up.
#ifndef KILOTWIN_SIMULATION_RECORDER_H
#define KILOTWIN_SIMULATION_RECORDER_H

#include <cstdint>
#include <vector>

#include "infrared/channel.h"
#include "physics/motion.h"

namespace kilotwin {

/// Columns of robots in samples beside poses, LEDs and sites.
struct SampleExtras {
    bool motors, battery, messages;
};

/// Row by row: one moment after the other, robots in order within each, and objects likewise.
struct Samples {
    std::vector<int64_t> tick;                 ///< nominal ticks since RUN
    std::vector<float> x_m, y_m, heading_rad;  ///< poses
    std::vector<uint8_t> led;                  ///< RGB()
    std::vector<uint8_t> site;                 ///< under the centre, 0 none
    // Empty where they were not asked for (SampleExtras).
    std::vector<uint8_t> left_duty, right_duty;       ///< as the motors are driven, 0..255
    std::vector<uint16_t> battery;                    ///< reading, 0..1023
    std::vector<uint32_t> sent, received, delivered;  ///< messages since the begin
    std::vector<float> object_x_m, object_y_m, object_heading_rad;  ///< poses of their own frames

    /// Appends a robot to the sample begun last; `tick` is the caller's.
    void add_robot(const Pose &pose, uint8_t color, uint8_t site_under);
    /// Append what SampleExtras asks for of that robot, each if so.
    void add_motors(uint8_t left, uint8_t right);
    void add_battery(int16_t reading) { battery.push_back(static_cast<uint16_t>(reading)); }
    void add_messages(const FrameCounts &counts, uint32_t taken);
    /// The same for an object.
    void add_object(const Pose &pose);
};

}  // namespace kilotwin

#endif
