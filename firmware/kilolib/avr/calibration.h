/// Calibration: the CALIB message (hardware.md 1.4), and the API's variables that the EEPROM holds.
#ifndef KILOLIB_AVR_CALIBRATION_H
#define KILOLIB_AVR_CALIBRATION_H

#include <stdint.h>

/// Payload of a CALIB message.
typedef struct {
    uint8_t mode;  ///< a calibration_mode_t
    uint16_t uid;
    uint8_t turn_left;
    uint8_t turn_right;
    uint8_t straight_left;
    uint8_t straight_right;
} calibration_t;

typedef enum {
    CALIBRATION_SAVE,
    CALIBRATION_UID,
    CALIBRATION_TURN_LEFT,
    CALIBRATION_TURN_RIGHT,
    CALIBRATION_STRAIGHT,
} calibration_mode_t;

/// Tunes the oscillator and sets kilo_uid and the motor values.
void kilolib_calibration_load(void);

/// Writes uid and motor values, into the EEPROM and the variables. Takes up to 21 ms.
void kilolib_calibration_save(const calibration_t *calibration);

/// The pins of port B to which the infrared LED is connected: as the EEPROM says if it says
/// something that can be, else PB0.
uint8_t kilolib_calibration_infrared_pins(void);

#endif
