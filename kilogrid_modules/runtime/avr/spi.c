#include "spi.h"

#include "board.h"

// Chip select must be an output, or a low level on it would make the chip a slave.
void runtime_spi_init(void) {
    PORTB |= CAN_SELECT;
    DDRB |= CAN_SELECT | SPI_MOSI | SPI_CLOCK;
    SPCR = BIT(SPE) | BIT(MSTR);
    SPSR = BIT(SPI2X);  // half the processor's clock
}

void runtime_spi_select(void) { PORTB &= (uint8_t)~CAN_SELECT; }
void runtime_spi_release(void) { PORTB |= CAN_SELECT; }

uint8_t runtime_spi_exchange(uint8_t byte) {
    SPDR = byte;
    while (!(SPSR & BIT(SPIF))) {
    }
    return SPDR;
}
