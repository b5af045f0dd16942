/// Signal strength of a received message (hardware.md 1.10). The distance estimated from it is
/// kilolib/core/gains.h.
#ifndef KILOTWIN_ROBOTS_INFRARED_GAINS_H
#define KILOTWIN_ROBOTS_INFRARED_GAINS_H

#include <cstddef>
#include <cstdint>

#include "kilolib/core/gains.h"

namespace kilotwin {

/// A robot's calibration tables: readings of the two amplifiers, 0..1023, at 14 distances 5 mm
/// apart from contact (33 mm) on. Synthetic: falls to 1/e in 25 mm, as light reflected by the table
/// between two robots does, times the robot's own sensitivity; or those of a lab's robot, between
/// whose entries its readings then lie. Immutable; a pointer: equal tables are one, for the life of
/// the process (some 10,000 synthetic ones differ).
class InfraredGains {
  public:
    /// `sensitivity`: of this robot's receiver, relative to the mean; above 0.
    explicit InfraredGains(double sensitivity = 1);

    /// A robot's measured tables; entries up to 1023.
    explicit InfraredGains(const gain_tables_t &measured);

    /// The converter's readings of a sender at `distance_mm`, centre to centre, with noise added to
    /// each gain before it is clamped to 0..1023.
    distance_measurement_t measure(double distance_mm, double low_noise_lsb = 0,
                                   double high_noise_lsb = 0) const;

    /// The same of synthetic tables, which follow from the first entry of low().
    static distance_measurement_t measure_synthetic(uint16_t low_at_contact, double distance_mm,
                                                    double low_noise_lsb, double high_noise_lsb);

    /// Distance in mm for a reading, 33..255, by the robot's own rule.
    uint8_t estimate_mm(distance_measurement_t measured) const {
        return kilolib_gains_distance(&tables_->entries, &measured);
    }

    /// Whether a lab has measured the tables: then they are what the receiver reads.
    bool are_measured() const { return tables_->measured; }

    // The tables' entries, 0..GAIN_ENTRIES - 1, as they stand in the EEPROM.
    uint16_t low(int entry) const { return tables_->entries.low[entry]; }
    uint16_t high(int entry) const { return tables_->entries.high[entry]; }

  private:
    struct Tables {
        gain_tables_t entries;
        bool measured;  ///< they hold what no formula does
        bool operator==(const Tables &other) const;
    };
    struct Hash {
        size_t operator()(const Tables &tables) const;
    };
    /// The one copy of such tables.
    static const Tables &shared(const Tables &tables);

    const Tables *tables_;
};

}  // namespace kilotwin

#endif
