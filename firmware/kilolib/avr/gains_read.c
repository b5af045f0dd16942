#include "gains_read.h"

#include <avr/eeprom.h>

#include "../core/eeprom_map.h"

static void read_table(uint16_t *table, uint16_t address) {
    const uint16_t *entry = (const uint16_t *)address;  // NOLINT(performance-no-int-to-ptr)
    for (uint8_t i = 0; i < GAIN_ENTRIES; i++) {
        const uint16_t gain = __builtin_bswap16(eeprom_read_word(entry + i));
        // Higher ones are no readings, but an erased EEPROM.
        table[i] = gain > CONVERTER_MOST ? CONVERTER_MOST : gain;
    }
}

void kilolib_gains_read(gain_tables_t *tables) {
    read_table(tables->low, EEPROM_LOW_GAIN);
    read_table(tables->high, EEPROM_HIGH_GAIN);
}
