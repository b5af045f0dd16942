#include "../core/traits.h"
#include "gains_read.h"
#include "kilolib.h"

static gain_tables_t tables;

// Before main(), so that only programs that estimate distances have the tables in memory; and not
// at the first estimate, which may be in an interrupt while the program itself reads the EEPROM.
static void __attribute__((constructor)) read_tables(void) { kilolib_gains_read(&tables); }

uint8_t estimate_distance(const distance_measurement_t *measurement) {
    ORIGINAL_TAKES_LONGER(1676);
    return kilolib_gains_distance(&tables, measurement);
}
