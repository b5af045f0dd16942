/// Messages on the CAN bus (hardware.md 3.2). What the runtime understands itself, commands,
/// configurations, polls, never reaches the program; every other frame does, by its callback.
#ifndef __CAN_H__
#define __CAN_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

#include "kilogrid.h"
#include "mcp2515.h"

/// data[0] of a message. The upper two bits are a cell's number in CAN_TRACKING_KILOBOT.
typedef enum {
    CAN_MODULE_USER = 0x00,
    CAN_FORWARD_IR_MESSAGE,
    CAN_FORWARD_IR_MESSAGE_STOP,
    CAN_KILO_BOOTPAGE,
    CAN_KILO_BOOTPAGE_SIZE,
    CAN_KILO_BOOTPAGE_NUMBER,
    CAN_MODULE_BOOT,
    CAN_MODULE_BOOTPAGE,
    CAN_MODULE_BOOTPAGE_SIZE,
    CAN_MODULE_BOOTPAGE_NUMBER,
    CAN_MODULE_KILOBOT_SETUP,
    CAN_MODULE_IDLE,
    CAN_MODULE_SETUP,
    CAN_MODULE_RUN,
    CAN_MODULE_PAUSE,  ///< ignored
    CAN_MODULE_CONFIG_SIZE,
    CAN_MODULE_CONFIG_TRANSFER,
    CAN_TRACKING_KILOBOT,
    CAN_KILOBOT_DATA,
    CAN_MODULE_DATA,
    CAN_TRACKING_KILOBOT_START,
    CAN_TRACKING_REQ,
    CAN_MODULE_TO_MODULE,  ///< by custom what programs tell one another; the runtime knows no such
} CAN_message_type_t;

/// A frame came in that the runtime does not understand. Runs in an interrupt: be short, light no
/// LEDs, do not wait.
typedef void (*CAN_message_rx_t)(CAN_message_t *message);

/// A frame was handed to the controller.
typedef void (*CAN_message_tx_success_t)(void);

/// Never NULL; they do nothing until the program installs its own. (C++ linkage in C++.)
extern CAN_message_rx_t module_CAN_message_rx;
extern CAN_message_tx_success_t module_CAN_message_tx_success;

#ifdef __cplusplus
extern "C" {
#endif

/// Eight data bytes, all zero.
void init_CAN_message(CAN_message_t *message);

/// Sends now, to modules or (ADDR_DISPATCHER, with the module's own x and y) to the host; fills in
/// the id. 1 if the controller took it, else 0.
uint8_t CAN_message_tx(CAN_message_t *message, kilogrid_address_t to);

/// Sends a copy to all modules after loop() has come back; a second one before then replaces it.
void CAN_send_broadcast_message(CAN_message_t *message);

/// Who a received message was for, or whose it is.
kilogrid_address_t get_coord_from_CAN_ID(CAN_message_t *message);

/// Fills a tracking record: what a robot reported through `cell` (0..3).
void serialize_tracking_message(CAN_message_t *message, uint8_t cell, tracking_user_data_t *data);

#ifdef __cplusplus
}
#endif

#endif
