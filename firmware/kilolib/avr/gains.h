/// From the strength of a message to the distance of its sender (hardware.md 1.10).
#ifndef KILOLIB_AVR_GAINS_H
#define KILOLIB_AVR_GAINS_H

#include <stdint.h>

#include "message.h"

#define GAIN_ENTRIES 14

/// Readings of the two gains, 0..1023, at distances of 33, 38 ... 98 mm.
typedef struct {
    uint16_t low[GAIN_ENTRIES];
    uint16_t high[GAIN_ENTRIES];
} gain_tables_t;

/// Reads the tables from the EEPROM; an erased one yields no distance, but nothing worse.
void kilolib_gains_read(gain_tables_t *tables);

/// In mm, 33 to 255, rounded down. High gain below 900, low gain where the high one is above 700,
/// blended between; linear between the entries and, with the slope of the last two, beyond them.
/// Whole numbers only, and exact.
uint8_t kilolib_gains_distance(const gain_tables_t *tables, const distance_measurement_t *measured);

#endif
