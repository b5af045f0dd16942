/// Pins of a Kilogrid module's ATmega328P: the one file to change for another board.
///
/// The values are those of the published module, revision A (Kilogrid/Kilogrid, src/module/IO.h and
/// ADC.h). The CAN controller has to run at 8 MHz: its clock is the processor's, which the fuse
/// CKOUT puts on PB0.
#ifndef MODULE_AVR_BOARD_H
#define MODULE_AVR_BOARD_H

#include <avr/io.h>

#define BIT(n) ((uint8_t)(1 << (n)))

/// Infrared LED: port B. The multiplexer behind it has two address lines on port D: the number of
/// the cell.
#define IR_LED BIT(PB1)
#define IR_LED_CELL_SHIFT PD3
#define IR_LED_CELL (BIT(PD3) | BIT(PD4))

/// Receivers' multiplexer: three address lines on port C, the number of the cell above the bit for
/// its high gain. Its output goes to the comparator and to this channel of the converter.
#define RECEIVER_SHIFT PC1
#define RECEIVER_ADDRESS (BIT(PC1) | BIT(PC2) | BIT(PC3))
#define RECEIVER_LOW_GAIN 0
#define RECEIVER_HIGH_GAIN 1
#define RECEIVER_CHANNEL 0
/// Reference of the converter, the REFS bits: the supply voltage.
#define CONVERTER_REFERENCE BIT(REFS0)

/// CAN controller, an MCP2515: chip select and SPI on port B, interrupt on INT0.
#define CAN_SELECT BIT(PB2)
#define SPI_MOSI BIT(PB3)
#define SPI_MISO BIT(PB4)
#define SPI_CLOCK BIT(PB5)
#define CAN_INTERRUPT BIT(PD2)

/// LED driver, a PCA9635 on the I2C bus: outputs 0 to 11 are red, green and blue of cells 0 to 3.
#define LED_DRIVER_ADDRESS 0x15
/// MODE2 of the driver: outputs open-drain, not inverted.
#define LED_DRIVER_MODE2 0x02

#endif
