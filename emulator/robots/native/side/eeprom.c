// Functions of <avr/eeprom.h>.
#include "avr/eeprom.h"

#include <string.h>

// Bounds of the EEMEM variables, if the program has any.
extern const uint8_t first_variable[] __asm__("__start_kt_eeprom") __attribute__((weak));
extern const uint8_t end_of_variables[] __asm__("__stop_kt_eeprom") __attribute__((weak));

// An EEMEM variable has an address of the PC; its place among these variables is that in the
// EEPROM.
static uint16_t address_of(const void *pointer, size_t offset) {
    uintptr_t address = (uintptr_t)pointer;
    if (address >= (uintptr_t)first_variable && address < (uintptr_t)end_of_variables) {
        address -= (uintptr_t)first_variable;
    }
    return (address + offset) & E2END;
}

void eeprom_read_block(void *to, const void *address, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) ((uint8_t *)to)[i] = kt_eeprom_read(address_of(address, i));
}

void eeprom_write_block(const void *from, void *address, size_t bytes) {
    const uint8_t *byte = from;
    for (size_t i = 0; i < bytes; i++) kt_eeprom_write(address_of(address, i), byte[i]);
}

void eeprom_update_block(const void *from, void *address, size_t bytes) {
    const uint8_t *byte = from;
    for (size_t i = 0; i < bytes; i++) {
        const uint16_t place = address_of(address, i);
        // Only cells that change are worn.
        if (kt_eeprom_read(place) != byte[i]) kt_eeprom_write(place, byte[i]);
    }
}

#define FUNCTIONS_FOR(name, type)                           \
    type eeprom_read_##name(const type *address) {          \
        type value;                                         \
        eeprom_read_block(&value, address, sizeof value);   \
        return value;                                       \
    }                                                       \
    void eeprom_write_##name(type *address, type value) {   \
        eeprom_write_block(&value, address, sizeof value);  \
    }                                                       \
    void eeprom_update_##name(type *address, type value) {  \
        eeprom_update_block(&value, address, sizeof value); \
    }

FUNCTIONS_FOR(byte, uint8_t)
FUNCTIONS_FOR(word, uint16_t)
FUNCTIONS_FOR(dword, uint32_t)
FUNCTIONS_FOR(float, float)
