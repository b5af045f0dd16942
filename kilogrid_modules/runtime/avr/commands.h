/// Orders from the CAN bus, carried out on the chip: the driver of core/orders.h.
#ifndef MODULE_AVR_COMMANDS_H
#define MODULE_AVR_COMMANDS_H

#include "../core/orders.h"

/// State and pending work of this module. Frames from the bus change it in an interrupt; the main
/// loop in runtime.c acts on it.
extern orders_t runtime_orders;

#endif
