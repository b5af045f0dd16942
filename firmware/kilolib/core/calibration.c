#include "calibration.h"

#include <stdbool.h>

#include "crc16.h"
#include "eeprom_map.h"
#include "gains.h"
#include "kilolib.h"

#define VALUES 6

// Bytes of a record.
enum {
    RECORD_SEQUENCE,                      // one more than the other record's
    RECORD_VALUES,                        // as CALIB carries them, from CALIB_UID_LOW on
    RECORD_CRC = RECORD_VALUES + VALUES,  // of what comes before; low half first
    RECORD_MARK = RECORD_CRC + 2,
};

// Values of RECORD_MARK. PENDING: the original's places may lag behind; so may they with the modes
// that write an entry of the gain tables. All others count as DONE.
enum { MARK_DONE = 0x4B, MARK_PENDING = 0xB4 };

// Where the original keeps each of a record's values.
static const uint8_t PLACES[VALUES] = {EEPROM_UID,           EEPROM_UID + 1,
                                       EEPROM_TURN_LEFT,     EEPROM_TURN_RIGHT,
                                       EEPROM_STRAIGHT_LEFT, EEPROM_STRAIGHT_RIGHT};

uint16_t kilo_uid;
uint8_t kilo_turn_left;
uint8_t kilo_turn_right;
uint8_t kilo_straight_left;
uint8_t kilo_straight_right;

static bool is_gains(uint8_t mode) {
    return mode >= CALIBRATION_GAINS && mode < CALIBRATION_GAINS + GAIN_ENTRIES;
}

// Place of a record's value; the uid comes first in all records. Not inlined: it takes more flash.
static uint8_t __attribute__((noinline)) place_of(uint8_t mark, uint8_t value) {
    if (mark == MARK_PENDING || value < 2) return PLACES[value];
    return eeprom_gain_place((uint8_t)(mark - CALIBRATION_GAINS), (uint8_t)(value - 2));
}

static crc16_t crc_of(uint16_t record, uint8_t bytes) {
    crc16_t crc = crc16_start();
    do crc16_add(&crc, kilolib_eeprom_read(record++));
    while (--bytes > 0);
    return crc;
}

// A power cut before the mark says DONE leaves it, and the next start does it again. The CRC over
// bytes and their own CRC is 0.
static void finish(uint16_t record) {
    const uint8_t mark = kilolib_eeprom_read(record + RECORD_MARK);
    if (mark != MARK_PENDING && !is_gains(mark)) return;
    if (crc16_value(crc_of(record, RECORD_MARK)) != 0) return;
    for (uint8_t i = 0; i < VALUES; i++)
        kilolib_eeprom_update(place_of(mark, i), kilolib_eeprom_read(record + RECORD_VALUES + i));
    kilolib_eeprom_update(record + RECORD_MARK, MARK_DONE);
}

// Places: eeprom_map.h; the uid is little-endian.
void kilolib_calibration_load(void) {
    finish(EEPROM_RECORD_1);
    finish(EEPROM_RECORD_2);
    kilo_uid =
        (uint16_t)(kilolib_eeprom_read(EEPROM_UID) | kilolib_eeprom_read(EEPROM_UID + 1) << 8);
    kilo_turn_left = kilolib_eeprom_read(EEPROM_TURN_LEFT);
    kilo_turn_right = kilolib_eeprom_read(EEPROM_TURN_RIGHT);
    kilo_straight_left = kilolib_eeprom_read(EEPROM_STRAIGHT_LEFT);
    kilo_straight_right = kilolib_eeprom_read(EEPROM_STRAIGHT_RIGHT);
}

// The older record is overwritten: sequence numbers go round, the newer one is less than half a
// round ahead. While it is, its mark says that there is nothing to be done.
void kilolib_calibration_save(const uint8_t *data) {
    uint16_t record = EEPROM_RECORD_2;
    uint8_t byte = kilolib_eeprom_read(EEPROM_RECORD_1 + RECORD_SEQUENCE);
    const uint8_t second = kilolib_eeprom_read(EEPROM_RECORD_2 + RECORD_SEQUENCE);
    if ((int8_t)(second - byte) > 0) {
        record = EEPROM_RECORD_1;
        byte = second;
    }
    byte++;
    kilolib_eeprom_update(record + RECORD_MARK, MARK_DONE);
    for (uint8_t i = RECORD_SEQUENCE; i != RECORD_CRC; i++) {
        kilolib_eeprom_update(record + i, byte);
        byte = data[CALIB_UID_LOW + i];
    }
    const crc16_t crc = crc_of(record, RECORD_CRC);
    kilolib_eeprom_update(record + RECORD_CRC, crc.low);
    kilolib_eeprom_update(record + RECORD_CRC + 1, crc.high);
    const uint8_t mode = data[CALIB_MODE];
    kilolib_eeprom_update(record + RECORD_MARK, mode == CALIBRATION_SAVE ? MARK_PENDING : mode);
    kilolib_calibration_load();
}

void kilolib_calibration_gains(uint8_t mode, uint8_t *bytes) {
    for (uint8_t i = 0; i < REPORT_CONTENT; i++)
        *bytes++ = kilolib_eeprom_read(place_of(mode, (uint8_t)(i + 2)));
}
