/// The serial bus to the LED driver, 100 kbit/s.
#ifndef MODULE_AVR_I2C_H
#define MODULE_AVR_I2C_H

#include <stdbool.h>
#include <stdint.h>

void runtime_i2c_init(void);

/// Writes `count` bytes to the registers of a device, from `first` on. False if nobody answers.
bool runtime_i2c_write(uint8_t device, uint8_t first, const uint8_t *bytes, uint8_t count);

#endif
