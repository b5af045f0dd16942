/// How strongly a robot receives another, and what distance it makes of that (hardware.md 1.10).
#ifndef KILOTWIN_GUEST_INFRARED_GAINS_H
#define KILOTWIN_GUEST_INFRARED_GAINS_H

#include <array>
#include <cstddef>
#include <cstdint>

#include "message.h"

namespace kilotwin {

/// Readings of the two amplifiers, 0..1023, at 14 distances 5 mm apart from contact (33 mm) on. A
/// synthetic table: falls to 1/e in 25 mm, as light reflected from the table between two robots
/// does, times a robot's own sensitivity.
class InfraredGains {
  public:
    static constexpr int ENTRIES = 14;
    static constexpr double FIRST_MM = 33, SPACING_MM = 5;

    explicit InfraredGains(double sensitivity = 1);

    /// What the converter reads of a robot at `distance_mm`, centre to centre, with `noise_lsb`
    /// added to each gain.
    distance_measurement_t measure(double distance_mm, double low_noise_lsb = 0,
                                   double high_noise_lsb = 0) const;

    /// The distance in mm that a reading stands for: the high gain below 900, the low gain where
    /// the high one is above 700, blended between; linear between the table's entries. At least 33,
    /// at most 255.
    uint8_t estimate_mm(distance_measurement_t measured) const;

    uint16_t low(int entry) const { return low_[static_cast<size_t>(entry)]; }
    uint16_t high(int entry) const { return high_[static_cast<size_t>(entry)]; }

  private:
    using Table = std::array<uint16_t, ENTRIES>;
    Table low_, high_;
};

}  // namespace kilotwin

#endif
