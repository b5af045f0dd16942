/// The module's place on the CAN bus: who it is, what it listens to, what it says. (Addresses are
/// those of protocol/address.h, whose names the API's kilogrid.h has as well: the two cannot be
/// included together, so they go through here as numbers.)
#ifndef MODULE_AVR_BUS_H
#define MODULE_AVR_BUS_H

#include <stdbool.h>
#include <stdint.h>

#include "can_controller.h"

/// Connects module (x, y) to the bus; with coordinates that cannot be it hears broadcasts only.
/// False if no controller answers.
bool runtime_bus_init(uint8_t x, uint8_t y);

/// Lets the controller's interrupt in; runtime_bus_received() is called by it, with interrupts on.
void runtime_bus_listen(void);

/// Implemented by who listens.
void runtime_bus_received(const can_frame_t *frame);

/// Sends a frame to an address of protocol/address.h; waits up to 10 ms for the one before. False
/// if there is no such address or the bus is stuck. From the main loop or from
/// runtime_bus_received().
bool runtime_bus_send(can_frame_t *frame, uint8_t x, uint8_t y, uint8_t type);

/// The same to the host, with the module's own coordinates.
bool runtime_bus_send_to_host(can_frame_t *frame);

/// Who a frame is for, or whose it is: x, y, type; zeros for an identifier that nobody has.
void runtime_bus_address_of(uint16_t id, uint8_t address[3]);

can_health_t runtime_bus_health(void);

#endif
