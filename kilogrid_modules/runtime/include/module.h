/// The Kilogrid module API: what a program that runs on a module of four cells may call.
///
/// The same headers serve the module (ATmega328P) and the emulator. A program calls module_init(),
/// installs its callbacks and calls module_start(). setup() runs once after each configuration, or
/// when the host orders SETUP; loop() runs from RUN on, as often as the processor can. moduleIR.h
/// has the infrared of the cells, moduleLED.h their light, CAN.h the bus.
#ifndef KILOGRID_MODULE_H
#define KILOGRID_MODULE_H

// Programs rely on these.
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/wdt.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <util/delay.h>

#include "CAN.h"
#include "debug.h"
#include "kilogrid.h"
#include "mcp2515.h"
#include "message.h"
#include "message_crc.h"
#include "module_limits.h"
#include "rand.h"
#include "ringbuffer.h"

/// Numbers of the cells, for loops.
#define CELL_LOWER_INDEX 0
#define CELL_UPPER_INDEX (CELL_LOWER_INDEX + (N_CELLS - 1))

/// Seen from above, y up: 0 top left, 1 top right, 2 bottom left, 3 bottom right.
typedef enum { CELL_00 = CELL_LOWER_INDEX, CELL_01, CELL_02, CELL_03 } cell_num_t;

/// Whole ticks in a time, which comes out 2 % longer: a tick is 32.768 ms.
#define MS_TO_TICKS(a) ((a) / 32)

/// The module's place in the grid, from its EEPROM: column in the low byte, row in the high one.
extern volatile uint16_t module_uid;
extern volatile uint8_t module_uid_x_coord;
extern volatile uint8_t module_uid_y_coord;

/// Ticks of 32.768 ms since module_init(). An interrupt counts its four bytes up. A failed attempt
/// to send by infrared makes one more.
extern volatile uint32_t module_ticks;

/// The configuration that the host sent last; size 0: none yet.
extern volatile uint8_t configuration_size;
extern volatile uint8_t configuration[MODULE_CONFIGURATION_BUFFER_SIZE];

#ifdef __cplusplus
extern "C" {
#endif

/// Sets up the hardware and shows that the lights work, which takes 1.2 s. First thing in main().
void module_init(void);

/// Obeys the host's orders, for ever.
void module_start(void (*setup)(void), void (*loop)(void));

/// Lets the program start without a host. To be called between the two.
void module_enable_autostart(void);

/// A place for a tracking record, to be filled by serialize_tracking_message() and handed out at
/// the next poll. NULL if CAN_MESSAGE_BUFFER_SIZE of them wait.
CAN_message_t *next_CAN_message(void);

/// A random number in low..high - 1, by rand(); low < high.
uint16_t get_random(uint16_t low, uint16_t high);

#ifdef __cplusplus
}
#endif

#endif
