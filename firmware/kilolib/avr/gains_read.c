#include <avr/eeprom.h>

#include "calibration.h"
#include "gains.h"

// The converter yields no more: it is no reading but an erased EEPROM.
#define GAIN_MOST 1023

static void read_table(uint16_t *table, uint16_t address) {
    const uint16_t *entry = (const uint16_t *)address;  // NOLINT(performance-no-int-to-ptr)
    for (uint8_t i = 0; i < GAIN_ENTRIES; i++) {
        const uint16_t gain = __builtin_bswap16(eeprom_read_word(entry + i));
        table[i] = gain > GAIN_MOST ? GAIN_MOST : gain;
    }
}

void kilolib_gains_read(gain_tables_t *tables) {
    read_table(tables->low, EEPROM_LOW_GAIN);
    read_table(tables->high, EEPROM_HIGH_GAIN);
}
