/// A robot's or module's EEPROM: 1,024 bytes with the calibration where kilolib (hardware.md 1.9)
/// and the module's runtime (3.3) keep it.
#ifndef KILOTWIN_GUEST_EEPROM_H
#define KILOTWIN_GUEST_EEPROM_H

#include <array>
#include <cstdint>

#include "base/clock.h"
#include "guest/infrared_gains.h"

namespace kilotwin {

constexpr uint16_t EEPROM_BYTES = 1024;
constexpr uint16_t EEPROM_TURN_LEFT = 0x05, EEPROM_TURN_RIGHT = 0x09;
constexpr uint16_t EEPROM_STRAIGHT_LEFT = 0x0C, EEPROM_STRAIGHT_RIGHT = 0x14;
constexpr uint16_t EEPROM_LOW_GAIN = 0x20, EEPROM_HIGH_GAIN = 0x50;  ///< 14 big-endian words each
constexpr uint16_t EEPROM_TX_MASK = 0x90, EEPROM_UID = 0xB0;         ///< uid little-endian

// A module's.
constexpr uint16_t EEPROM_X = 0xB2, EEPROM_Y = 0xB3;
constexpr uint16_t EEPROM_CALIB_RESTRICTED = 0xB4;  ///< 1: only modules within ...
constexpr uint16_t EEPROM_CALIB_X_MIN = 0xB5, EEPROM_CALIB_X_MAX = 0xB6;  ///< ... these bounds ...
constexpr uint16_t EEPROM_CALIB_Y_MIN = 0xB7, EEPROM_CALIB_Y_MAX = 0xB8;  ///< ... forward CALIB

using EepromImage = std::array<uint8_t, EEPROM_BYTES>;

/// How one robot differs from the next: what its EEPROM says of it, and its clock.
struct Calibration {
    Cycles tick;  ///< by its own oscillator
    uint16_t uid;
    uint8_t turn_left, turn_right, straight_left, straight_right;
    InfraredGains gains;
};

/// The byte that calibration leaves at an address, 0..1023: uid, duties, gain tables, the IR LED on PB0. OSCCAL
/// and all else is erased, 0xFF.
uint8_t calibrated_byte(const Calibration &calibration, uint16_t address);

/// All of them.
EepromImage eeprom_of(const Calibration &calibration);

}  // namespace kilotwin

#endif
