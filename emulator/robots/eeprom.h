/// A robot's or module's EEPROM: 1,024 bytes with the calibration where kilolib (hardware.md 1.9)
/// and the module's runtime (3.3) keep it.
#ifndef KILOTWIN_ROBOTS_EEPROM_H
#define KILOTWIN_ROBOTS_EEPROM_H

#include <array>
#include <cstdint>
#include <optional>

#include "base/clock.h"
#include "kilolib/core/eeprom_map.h"
#include "robots/infrared_gains.h"

namespace kilotwin {

using EepromImage = std::array<uint8_t, EEPROM_BYTES>;

/// How one robot differs from the next: what its EEPROM says of it, and its clock.
struct Calibration {
    Cycles tick;  ///< by its own oscillator
    uint16_t uid;
    uint8_t turn_left, turn_right, straight_left, straight_right;
    InfraredGains gains;
};

/// The byte of the gain tables at `address`; none elsewhere. Robots and modules keep them at the
/// same addresses, each gain's upper byte first.
std::optional<uint8_t> gain_byte(const InfraredGains &gains, uint16_t address);

/// The byte that calibration leaves at an address, 0..1023: uid, duties, gain tables, the IR LED on
/// PB0. OSCCAL and all else is erased, 0xFF.
uint8_t calibrated_byte(const Calibration &calibration, uint16_t address);

/// All of them.
EepromImage eeprom_of(const Calibration &calibration);

}  // namespace kilotwin

#endif
