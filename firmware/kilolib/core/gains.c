#include "gains.h"

#define FARTHEST_MM 255
#define HIGH_ONLY_BELOW 700
#define LOW_ONLY_ABOVE 900
#define BLEND (LOW_ONLY_ABOVE - HIGH_ONLY_BELOW)

/// whole + part / fall, in mm beyond contact.
typedef struct {
    int16_t whole;
    uint16_t part;
    uint16_t fall;  ///< from one entry of the table to the next, at least 1
} distance_t;

static distance_t distance_of(const uint16_t *table, int16_t gain) {
    uint8_t i = 1;
    while (i + 1 < GAIN_ENTRIES && gain < (int16_t)table[i]) i++;
    const int16_t fall = (int16_t)(table[i - 1] - table[i]);
    const int16_t divisor = fall < 1 ? 1 : fall;
    const int16_t above = (int16_t)(GAIN_SPACING_MM * ((int16_t)table[i - 1] - gain));
    int16_t whole = (int16_t)(above / divisor);
    int16_t part = (int16_t)(above % divisor);
    if (part < 0) {
        part = (int16_t)(part + divisor);
        whole--;
    }
    return (distance_t){(int16_t)(whole + GAIN_SPACING_MM * (i - 1)), (uint16_t)part,
                        (uint16_t)divisor};
}

// The whole millimetres of share / BLEND of one distance and the rest of the other.
static int16_t blend(distance_t near, distance_t far, uint8_t share) {
    const uint8_t rest = (uint8_t)(BLEND - share);
    const int32_t whole = (int32_t)near.whole * share + (int32_t)far.whole * rest;
    const uint32_t parts =
        (uint32_t)near.part * far.fall * share + (uint32_t)far.part * near.fall * rest;
    const int32_t sum = whole + (int32_t)(parts / ((uint32_t)near.fall * far.fall));
    return (int16_t)(sum < 0 ? 0 : sum / BLEND);
}

uint8_t kilolib_gains_distance(const gain_tables_t *tables,
                               const distance_measurement_t *measured) {
    const int16_t high = measured->high_gain, low = measured->low_gain;
    int16_t mm;
    if (high <= HIGH_ONLY_BELOW) {
        mm = distance_of(tables->high, high).whole;
    } else if (high >= LOW_ONLY_ABOVE) {
        mm = distance_of(tables->low, low).whole;
    } else {
        mm = blend(distance_of(tables->low, low), distance_of(tables->high, high),
                   (uint8_t)(high - HIGH_ONLY_BELOW));
    }
    if (mm < 0) mm = 0;
    return mm > FARTHEST_MM - GAIN_CONTACT_MM ? FARTHEST_MM : (uint8_t)(mm + GAIN_CONTACT_MM);
}
