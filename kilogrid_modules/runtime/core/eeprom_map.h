/// EEPROM map of a Kilogrid module (hardware.md 3.3): what the 1,024 bytes hold beside the tables
/// of infrared gains, which lie where a robot has them (hardware.md 1.9).
///
/// An erased byte reads 0xFF: a module whose place was never written receives broadcasts only, and
/// calibration is not restricted. The boot loader of the published modules keeps the mark of a
/// valid program at 0xB4 as well, a clash in its source: bounds that are erased restrict nothing.
/// Ours keeps no mark here.
#ifndef MODULE_CORE_EEPROM_MAP_H
#define MODULE_CORE_EEPROM_MAP_H

#define EEPROM_X 0xB2  ///< column of the module, 0..30
#define EEPROM_Y 0xB3  ///< row of the module, 0..30

/// The calibration area, a calibration_area_t (orders.h): five bytes.
#define EEPROM_CALIB_RESTRICTED 0xB4  ///< 1: the bounds below hold, unless they are erased
#define EEPROM_CALIB_X_MIN 0xB5       ///< bounds of columns and rows, both included
#define EEPROM_CALIB_X_MAX 0xB6
#define EEPROM_CALIB_Y_MIN 0xB7
#define EEPROM_CALIB_Y_MAX 0xB8

/// An address as avr-libc takes it.
#define EEPROM_AT(address) ((uint8_t *)(address))

#endif
