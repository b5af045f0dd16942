#include "../core/calibration.h"

#include <avr/eeprom.h>

// Addresses in the EEPROM are numbers; avr-libc wants pointers.
uint8_t kilolib_eeprom_read(uint16_t address) {
    return eeprom_read_byte((const uint8_t *)address);  // NOLINT(performance-no-int-to-ptr)
}

void kilolib_eeprom_update(uint16_t address, uint8_t value) {
    eeprom_update_byte((uint8_t *)address, value);  // NOLINT(performance-no-int-to-ptr)
}
