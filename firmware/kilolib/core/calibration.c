#include "calibration.h"

#include "eeprom_map.h"
#include "kilolib.h"

uint16_t kilo_uid;
uint8_t kilo_turn_left;
uint8_t kilo_turn_right;
uint8_t kilo_straight_left;
uint8_t kilo_straight_right;

// Places: eeprom_map.h; the uid is little-endian.
void kilolib_calibration_load(void) {
    kilo_uid =
        (uint16_t)(kilolib_eeprom_read(EEPROM_UID) | kilolib_eeprom_read(EEPROM_UID + 1) << 8);
    kilo_turn_left = kilolib_eeprom_read(EEPROM_TURN_LEFT);
    kilo_turn_right = kilolib_eeprom_read(EEPROM_TURN_RIGHT);
    kilo_straight_left = kilolib_eeprom_read(EEPROM_STRAIGHT_LEFT);
    kilo_straight_right = kilolib_eeprom_read(EEPROM_STRAIGHT_RIGHT);
}

// A power cut in between leaves some of the old bytes: the controller saves again.
void kilolib_calibration_save(const uint8_t *data) {
    kilolib_eeprom_update(EEPROM_UID, data[CALIB_UID_LOW]);
    kilolib_eeprom_update(EEPROM_UID + 1, data[CALIB_UID_HIGH]);
    kilolib_eeprom_update(EEPROM_TURN_LEFT, data[CALIB_TURN_LEFT]);
    kilolib_eeprom_update(EEPROM_TURN_RIGHT, data[CALIB_TURN_RIGHT]);
    kilolib_eeprom_update(EEPROM_STRAIGHT_LEFT, data[CALIB_STRAIGHT_LEFT]);
    kilolib_eeprom_update(EEPROM_STRAIGHT_RIGHT, data[CALIB_STRAIGHT_RIGHT]);
    kilolib_calibration_load();
}
