/// The loader's node on the CAN bus: receives frames into a queue, by interrupts, also while flash
/// is written.
#ifndef MODULE_BOOTLOADER_AVR_BUS_H
#define MODULE_BOOTLOADER_AVR_BUS_H

#include "can_controller.h"

/// Connects the module to the bus, with the place that the EEPROM has (EEPROM_X, EEPROM_Y), and
/// enables the controller's interrupt. A place that no module can have, such as that of an erased
/// EEPROM, receives broadcasts only, and does not answer.
void boot_bus_init(void);

/// The oldest frame; NULL if there is none. The queue has room for 63: what comes while it is full
/// is lost. A page takes 23.
const can_frame_t *boot_bus_oldest(void);

/// Takes the oldest frame out of the queue. The pointer to it is not valid any more.
void boot_bus_drop_oldest(void);

/// Sends a frame of eight data bytes to the host; fills in id and length. False if the frame before
/// still waits for the bus. True also if the module has no identifier.
bool boot_bus_send(can_frame_t *frame);

#endif
