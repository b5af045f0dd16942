/// What of the Kilobot's board hangs on which pin of its ATmega328P (hardware.md 1.8).
#ifndef KILOLIB_AVR_BOARD_H
#define KILOLIB_AVR_BOARD_H

#include <avr/io.h>

#define BIT(n) ((uint8_t)(1 << (n)))

/// The motors hang on the outputs of timer 2; a pin that is an input stops its motor.
#define LEFT_MOTOR BIT(PB3)   ///< of port B, OCR2A
#define RIGHT_MOTOR BIT(PD3)  ///< of port D, OCR2B

/// The LED: a pin that is an output, low, lights its part. The two pins of a colour drive different
/// currents.
#define LED_ON_C (BIT(PC2) | BIT(PC3) | BIT(PC4) | BIT(PC5))
#define LED_ON_D (BIT(PD4) | BIT(PD5))

/// Port D.
#define CHARGING_WHEN_LOW BIT(PD0)
#define RECEIVER_POWER BIT(PD2)

/// Channels of the converter.
#define HIGH_GAIN_CHANNEL 0
#define LOW_GAIN_CHANNEL 1
#define BATTERY_CHANNEL 6
#define LIGHT_CHANNEL 7
#define TEMPERATURE_CHANNEL 8

/// Pins of port B that may drive the infrared LED; which ones do, the EEPROM says.
#define INFRARED_PINS (BIT(PB0) | BIT(PB1) | BIT(PB2) | BIT(PB6) | BIT(PB7))
#define INFRARED_DEFAULT_PIN BIT(PB0)

#endif
