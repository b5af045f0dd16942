/// Driver of the SPI bus to the CAN controller, 4 Mbit/s.
#ifndef MODULE_AVR_SPI_H
#define MODULE_AVR_SPI_H

#include <stdint.h>

/// Makes the chip the master; the controller is not selected.
void runtime_spi_init(void);

/// Begins and ends an instruction to the controller: its chip select goes low and high.
void runtime_spi_select(void);
void runtime_spi_release(void);

/// Sends a byte and returns the one that comes back for it. Waits 2 us.
uint8_t runtime_spi_exchange(uint8_t byte);

#endif
