#include "calibration.h"

#include <avr/eeprom.h>
#include <stdbool.h>

#include "../core/eeprom_map.h"
#include "board.h"
#include "kilolib.h"

#define ERASED 0xFF

uint16_t kilo_uid;
uint8_t kilo_turn_left;
uint8_t kilo_turn_right;
uint8_t kilo_straight_left;
uint8_t kilo_straight_right;

// Addresses in the EEPROM are numbers; avr-libc wants pointers.
static uint8_t read(uint16_t address) {
    return eeprom_read_byte((const uint8_t *)address);  // NOLINT(performance-no-int-to-ptr)
}

// Only what differs is written: a cell wears out after 100,000 times.
static void update(uint16_t address, uint8_t value) {
    eeprom_update_byte((uint8_t *)address, value);  // NOLINT(performance-no-int-to-ptr)
}

void kilolib_calibration_load(void) {
    const uint8_t osccal = read(EEPROM_OSCCAL);
    if (osccal != ERASED) OSCCAL = osccal;
    kilo_uid = (uint16_t)(read(EEPROM_UID) | read(EEPROM_UID + 1) << 8);
    kilo_turn_left = read(EEPROM_TURN_LEFT);
    kilo_turn_right = read(EEPROM_TURN_RIGHT);
    kilo_straight_left = read(EEPROM_STRAIGHT_LEFT);
    kilo_straight_right = read(EEPROM_STRAIGHT_RIGHT);
}

void kilolib_calibration_save(const calibration_t *calibration) {
    update(EEPROM_UID, (uint8_t)calibration->uid);
    update(EEPROM_UID + 1, (uint8_t)(calibration->uid >> 8));
    update(EEPROM_TURN_LEFT, calibration->turn_left);
    update(EEPROM_TURN_RIGHT, calibration->turn_right);
    update(EEPROM_STRAIGHT_LEFT, calibration->straight_left);
    update(EEPROM_STRAIGHT_RIGHT, calibration->straight_right);
    kilolib_calibration_load();
}

uint8_t kilolib_calibration_infrared_pins(void) {
    const uint8_t pins = read(EEPROM_INFRARED_PINS);
    const bool legal = pins != 0 && (pins & (uint8_t)~INFRARED_PINS) == 0;
    return legal ? pins : INFRARED_DEFAULT_PIN;
}
