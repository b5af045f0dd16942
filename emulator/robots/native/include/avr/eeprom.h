/// The robot's EEPROM, 1,024 bytes, of which kilolib uses some (calibration, uid). Addresses are
/// pointers: numbers cast to one, or the addresses of EEMEM variables, whose bytes lie from 0 on in
/// the order that the linker gives them. Words lie lowest byte first.
///
/// A write is done when the call returns.
#ifndef KT_AVR_EEPROM_H
#define KT_AVR_EEPROM_H

#include "io.h"

/// Initial values are not in the EEPROM, as they are not on a robot flashed by infrared.
#define EEMEM __attribute__((section("kt_eeprom")))

#define eeprom_is_ready() 1
#define eeprom_busy_wait() \
    do {                   \
    } while (!eeprom_is_ready())

uint8_t eeprom_read_byte(const uint8_t *address);
uint16_t eeprom_read_word(const uint16_t *address);
uint32_t eeprom_read_dword(const uint32_t *address);
float eeprom_read_float(const float *address);
void eeprom_read_block(void *to, const void *address, size_t bytes);

void eeprom_write_byte(uint8_t *address, uint8_t value);
void eeprom_write_word(uint16_t *address, uint16_t value);
void eeprom_write_dword(uint32_t *address, uint32_t value);
void eeprom_write_float(float *address, float value);
void eeprom_write_block(const void *from, void *address, size_t bytes);

/// As write, but bytes that have the value already are not written.
void eeprom_update_byte(uint8_t *address, uint8_t value);
void eeprom_update_word(uint16_t *address, uint16_t value);
void eeprom_update_dword(uint32_t *address, uint32_t value);
void eeprom_update_float(float *address, float value);
void eeprom_update_block(const void *from, void *address, size_t bytes);

#endif
