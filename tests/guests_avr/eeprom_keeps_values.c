// EEPROM: by address, by EEMEM variable and by register.
#include <avr/eeprom.h>
#include <avr/io.h>
#include <string.h>

#include "check.h"

#define UID_ADDRESS ((const uint16_t *)0xB0)

static uint8_t EEMEM stored_byte;
static uint32_t EEMEM stored_number = 5;
static char EEMEM stored_text[8];

static uint8_t by_register(uint16_t address) {
    while (EECR & _BV(EEPE)) {
    }
    EEAR = address;
    EECR |= _BV(EERE);
    return EEDR;
}

static void write_by_register(uint16_t address, uint8_t value) {
    EEAR = address;
    EEDR = value;
    EECR |= _BV(EEMPE);
    EECR |= _BV(EEPE);
    loop_until_bit_is_clear(EECR, EEPE);
}

static void check(void) {
    CHECK(eeprom_read_word(UID_ADDRESS) == kilo_uid);
    CHECK(by_register(0xB0) == (kilo_uid & 0xFF));

    eeprom_write_byte((uint8_t *)0x3F0, 17);
    eeprom_busy_wait();
    CHECK(eeprom_read_byte((const uint8_t *)0x3F0) == 17);
    CHECK(by_register(0x3F0) == 17);
    write_by_register(0x3F0, 18);
    CHECK(eeprom_read_byte((const uint8_t *)0x3F0) == 18);

    eeprom_update_word((uint16_t *)0x3F2, 0x1234);
    CHECK(eeprom_read_byte((const uint8_t *)0x3F2) == 0x34);
    CHECK(eeprom_read_word((const uint16_t *)0x3F2) == 0x1234);
    eeprom_write_float((float *)0x3F4, 2.5f);
    CHECK(eeprom_read_float((const float *)0x3F4) == 2.5f);

    char text[8];
    eeprom_update_byte(&stored_byte, 1);
    eeprom_update_dword(&stored_number, 70000);
    eeprom_write_block("seven..", stored_text, sizeof stored_text);
    eeprom_read_block(text, stored_text, sizeof text);
    CHECK(eeprom_read_byte(&stored_byte) == 1);
    CHECK(eeprom_read_dword(&stored_number) == 70000);
    CHECK(strcmp(text, "seven..") == 0);
}
