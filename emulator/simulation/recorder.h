/// Samples of what can be seen of the robots, and the numbers that a run adds up.
#ifndef KILOTWIN_SIMULATION_RECORDER_H
#define KILOTWIN_SIMULATION_RECORDER_H

#include <array>
#include <cstdint>
#include <vector>

#include "physics/motion.h"

namespace kilotwin {

/// Row by row: one moment after the other, robots in order within each.
struct Samples {
    std::vector<int64_t> tick;  ///< nominal ticks since RUN
    std::vector<float> x_m, y_m, heading_rad;
    std::vector<uint8_t> led;   ///< RGB()
    std::vector<uint8_t> site;  ///< under the centre, 0 none

    void add_robot(const Pose &pose, uint8_t color, uint8_t site_under);
};

/// How far bodies lie in one another, as fractions of a diameter, over all contacts of all steps.
class Overlaps {
  public:
    void add(double fraction);
    uint64_t contacts() const { return contacts_; }
    double worst() const { return worst_; }
    double median() const;  ///< upper edge of the class of 0.0001 that holds it; 0 without contacts

  private:
    static constexpr double CLASS = 0.0001;
    std::array<uint64_t, 2001> classes_{};
    uint64_t contacts_ = 0;
    double worst_ = 0;
};

/// FNV-1a over final float32 poses and LEDs in robot order: what "same result" means.
uint64_t result_hash(const Samples &now);

}  // namespace kilotwin

#endif
