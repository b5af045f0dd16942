/// Pins of the Kilobot's board that only the chip's drivers use (hardware.md 1.8); those of motors
/// and LED are in core/pins.h.
#ifndef KILOLIB_AVR_BOARD_H
#define KILOLIB_AVR_BOARD_H

#include <avr/io.h>

/// A bit of a register, by its number.
#define BIT(n) ((uint8_t)(1 << (n)))

/// Port D.
#define CHARGING_WHEN_LOW BIT(PD0)  ///< the charger is at work
#define RECEIVER_POWER BIT(PD2)     ///< comparator and amplifiers

/// Channels of the converter beside those of sensors (core/sensors.h).
#define HIGH_GAIN_CHANNEL 0
#define LOW_GAIN_CHANNEL 1

/// Pins of port B that may drive the infrared LED; the EEPROM holds which ones do.
#define INFRARED_PINS (BIT(PB0) | BIT(PB1) | BIT(PB2) | BIT(PB6) | BIT(PB7))
#define INFRARED_DEFAULT_PIN BIT(PB0)

#endif
