/// The module's node on the CAN bus: its filters, reception by interrupt, sending with retries.
///
/// Addresses are those of protocol/address.h. The API's kilogrid.h has the same names, so the two
/// cannot be included together: addresses cross here as numbers.
#ifndef MODULE_AVR_BUS_H
#define MODULE_AVR_BUS_H

#include <stdbool.h>
#include <stdint.h>

#include "can_controller.h"

/// Connects module (x, y) to the bus. A place that no module can have, such as that of an erased
/// EEPROM, receives broadcasts only. False if no controller answers, after 200 tries.
bool runtime_bus_init(uint8_t x, uint8_t y);

/// Enables the controller's interrupt, from which runtime_bus_received() is called.
void runtime_bus_listen(void);

/// Takes a received frame; implemented in commands.c. Interrupts are on, but for the controller's
/// own: pulses of infrared are not lost meanwhile.
void runtime_bus_received(const can_frame_t *frame);

/// Sends a frame to an address; fills in frame->id. Waits up to 10 ms for the frame before. False
/// if there is no such address or the bus is stuck. From the main loop or from
/// runtime_bus_received().
bool runtime_bus_send(can_frame_t *frame, uint8_t x, uint8_t y, uint8_t type);

/// Sends a frame to the host, with the module's own coordinates.
bool runtime_bus_send_to_host(can_frame_t *frame);

/// Address of an identifier: x, y, type; zeros for an identifier that no frame has.
void runtime_bus_address_of(uint16_t id, uint8_t address[3]);

/// Error counters of the controller. From the main loop.
can_health_t runtime_bus_health(void);

#endif
