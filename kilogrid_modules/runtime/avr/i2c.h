/// Driver of the I2C bus to the LED driver, 100 kbit/s. Busy waiting: 0.1 ms a byte. Main loop
/// only.
#ifndef MODULE_AVR_I2C_H
#define MODULE_AVR_I2C_H

#include <stdbool.h>
#include <stdint.h>

/// Sets the bit rate.
void runtime_i2c_init(void);

/// Writes `count` bytes to the registers of a device, from `first` on. False if no device answers;
/// a bus that hangs is given up after a few bytes' time.
bool runtime_i2c_write(uint8_t device, uint8_t first, const uint8_t *bytes, uint8_t count);

#endif
