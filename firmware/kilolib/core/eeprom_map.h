/// EEPROM map of a Kilobot (hardware.md 1.9). A Kilogrid module keeps its gain tables and its uid
/// at the same addresses.
///
/// An erased byte is 0xFF.
#ifndef KILOLIB_CORE_EEPROM_MAP_H
#define KILOLIB_CORE_EEPROM_MAP_H

#include <stdint.h>

#define EEPROM_BYTES 1024

#define EEPROM_OSCCAL 0x01  ///< of the oscillator; erased: keep the factory's
#define EEPROM_TURN_LEFT 0x05
#define EEPROM_TURN_RIGHT 0x09
#define EEPROM_STRAIGHT_LEFT 0x0C
#define EEPROM_STRAIGHT_RIGHT 0x14
#define EEPROM_LOW_GAIN 0x20       ///< GAIN_ENTRIES big-endian words (gains.h)
#define EEPROM_HIGH_GAIN 0x50      ///< GAIN_ENTRIES big-endian words
#define EEPROM_INFRARED_PINS 0x90  ///< pins of port B that drive the infrared LED
#define EEPROM_UID 0xB0            ///< little-endian word

// Ours: two records of 10 bytes of what calibration saves (calibration.h). The original leaves this
// end free.
#define EEPROM_RECORD_1 0x3E0
#define EEPROM_RECORD_2 0x3F0

/// Place of one of the four bytes of an entry of both gain tables: 0 and 1 are the low gain's upper
/// and lower byte, 2 and 3 the high gain's.
static inline uint8_t eeprom_gain_place(uint8_t entry, uint8_t byte) {
    const uint8_t table = byte < 2 ? EEPROM_LOW_GAIN : EEPROM_HIGH_GAIN - 2;
    return (uint8_t)(table + 2 * entry + byte);
}

#endif
