/// What a module's EEPROM holds (hardware.md 3.3), besides the tables of distances, which are where
/// a robot has them.
#ifndef MODULE_AVR_PLACES_H
#define MODULE_AVR_PLACES_H

#include <stdint.h>

#define X_COORDINATE 0xB2
#define Y_COORDINATE 0xB3
#define CALIBRATION_RESTRICTED 0xB4  ///< 1: CALIB is forwarded within these bounds only
#define CALIBRATION_X_MIN 0xB5
#define CALIBRATION_X_MAX 0xB6
#define CALIBRATION_Y_MIN 0xB7
#define CALIBRATION_Y_MAX 0xB8

/// As avr-libc wants an address.
#define PLACE(address) ((uint8_t *)(address))

#endif
