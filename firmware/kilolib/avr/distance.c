#include <avr/eeprom.h>

#include "calibration.h"
#include "gains.h"
#include "kilolib.h"

// More than the converter yields is no reading but an erased EEPROM, of which no distance comes.
#define GAIN_MOST 1023

static gain_tables_t tables;

static void read_table(uint16_t *table, uint16_t address) {
    for (uint8_t i = 0; i < GAIN_ENTRIES; i++) {
        const uint16_t gain = __builtin_bswap16(eeprom_read_word((const uint16_t *)address));
        table[i] = gain > GAIN_MOST ? GAIN_MOST : gain;
        address += sizeof gain;
    }
}

// Before main(), so that only programs that ask for distances have the tables in memory; and not
// when they are asked for, which may be in an interrupt while the program itself reads the EEPROM.
static void __attribute__((constructor)) read_tables(void) {
    read_table(tables.low, EEPROM_LOW_GAIN);
    read_table(tables.high, EEPROM_HIGH_GAIN);
}

uint8_t estimate_distance(const distance_measurement_t *measurement) {
    return gains_distance(&tables, measurement);
}
