/// Gain tables from the EEPROM, for robots and the Kilogrid's modules.
#ifndef KILOLIB_AVR_GAINS_READ_H
#define KILOLIB_AVR_GAINS_READ_H

#include "../core/gains.h"

/// Reads both tables; entries of an erased EEPROM become CONVERTER_MOST.
void kilolib_gains_read(gain_tables_t *tables);

#endif
