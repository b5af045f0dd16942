/// Infrared of the cells.
///
/// Each cell repeats its message every 16 ticks (524 ms): one transmission each 4 ticks, the cells
/// in turn. The receiver dwells on one cell at a time, 10.24 ms each, in turn;
/// nothing is received while a cell sends (4.4 ms).
#ifndef KILOGRID_MODULE_IR_H
#define KILOGRID_MODULE_IR_H

#include "message.h"
#include "module.h"

/// Rounded up: there are 30.518 ticks in a second.
#define TICKS_PER_SEC 32
/// Seconds in ticks: 4.9 % too long.
#define SEC_TO_TICKS(a) ((a)*TICKS_PER_SEC)

/// A message came in at a cell, checksum right (crc_error 0) or not. Runs in an interrupt; the
/// pointers are valid until it returns.
typedef void (*IR_message_rx_t)(IR_message_t *message, cell_num_t cell,
                                distance_measurement_t *distance, uint8_t crc_error);

/// A cell's message went out. Runs in an interrupt.
typedef void (*IR_message_tx_success_t)(cell_num_t cell);

/// Never NULL; they do nothing until the program installs its own. (C++ linkage in C++.)
extern IR_message_rx_t module_IR_message_rx;
extern IR_message_tx_success_t module_IR_message_tx_success;

#ifdef __cplusplus
extern "C" {
#endif

/// All zero.
void init_IR_message(IR_message_t *message);

/// The cell repeats a copy of the message, with its checksum, until disable_IR_tx() or the next
/// call. NULL: nothing happens.
void set_IR_message(IR_message_t *message, cell_num_t cell);
/// The cell sends nothing any more. A frame on air is finished.
void disable_IR_tx(cell_num_t cell);

/// Sends once, now, and waits meanwhile (4.4 ms); computes the checksum. Lost if the channel is
/// busy.
void send_IR_message(IR_message_t *message, cell_num_t cell);

/// Distance of the sender in mm, by the tables in the module's EEPROM; 33 at least.
uint8_t estimate_distance_mm(const distance_measurement_t *distance, cell_num_t cell);

#ifdef __cplusplus
}
#endif

#endif
