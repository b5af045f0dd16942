/// Distance of a sender from the strength of its message (hardware.md 1.10).
///
/// Pure: no registers, nothing allocated; whole numbers only, so that every machine computes the
/// same.
#ifndef KILOLIB_CORE_GAINS_H
#define KILOLIB_CORE_GAINS_H

#include <stdint.h>

#include "message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CONVERTER_MOST 1023  ///< highest reading of the 10-bit converter
#define GAIN_ENTRIES 14
#define GAIN_CONTACT_MM 33  ///< distance of the first entry: robots touch
#define GAIN_SPACING_MM 5   ///< from one entry to the next

/// Readings of the two gains, 0..1023, at distances of 33, 38 ... 98 mm. They should fall.
typedef struct {
    uint16_t low[GAIN_ENTRIES];
    uint16_t high[GAIN_ENTRIES];
} gain_tables_t;

/// Distance in mm between the centres, 33 to 255, rounded down. High gain below 900, low gain where
/// the high one is above 700, blended between; linear between the entries and, with the slope of
/// the last two, beyond them. Exact. Tables of an erased EEPROM yield no sensible distance, but no
/// other harm. About 1,000 cycles on an AVR where the gains are blended.
uint8_t kilolib_gains_distance(const gain_tables_t *tables, const distance_measurement_t *measured);

#ifdef __cplusplus
}
#endif

#endif
