/// Signal strength of a received message, and the distance estimated from it (hardware.md 1.10).
#ifndef KILOTWIN_GUEST_INFRARED_GAINS_H
#define KILOTWIN_GUEST_INFRARED_GAINS_H

#include <array>
#include <cstddef>
#include <cstdint>

#include "message.h"

namespace kilotwin {

/// A robot's calibration tables: readings of the two amplifiers, 0..1023, at 14 distances 5 mm
/// apart from contact (33 mm) on. Synthetic: falls to 1/e in 25 mm, as light reflected by the table
/// between two robots does, times the robot's own sensitivity. Immutable; 56 bytes.
class InfraredGains {
  public:
    static constexpr int ENTRIES = 14;
    /// Distance of the first entry, and between entries.
    static constexpr double FIRST_MM = 33, SPACING_MM = 5;

    /// `sensitivity`: of this robot's receiver, relative to the mean; above 0.
    explicit InfraredGains(double sensitivity = 1);

    /// The converter's readings of a sender at `distance_mm`, centre to centre, with noise added to
    /// each gain before it is clamped to 0..1023.
    distance_measurement_t measure(double distance_mm, double low_noise_lsb = 0,
                                   double high_noise_lsb = 0) const;

    /// Distance in mm for a reading, 33..255: by the high gain below 700, by the low gain where the
    /// high one is above 900, blended between; linear between the table's entries.
    uint8_t estimate_mm(distance_measurement_t measured) const;

    // The tables' entries, 0..ENTRIES - 1, as they stand in the EEPROM.
    uint16_t low(int entry) const { return low_[static_cast<size_t>(entry)]; }
    uint16_t high(int entry) const { return high_[static_cast<size_t>(entry)]; }

  private:
    using Table = std::array<uint16_t, ENTRIES>;
    Table low_, high_;
};

}  // namespace kilotwin

#endif
