/// Messages on the CAN bus (hardware.md 3.2). What the runtime understands itself, commands,
/// configurations, polls, never reaches the program; every other frame does, by its callback.
#ifndef __CAN_H__
#define __CAN_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

#include "kilogrid.h"
#include "mcp2515.h"

/// data[0] of a message. The upper two bits are a cell's number in CAN_TRACKING_KILOBOT.
typedef enum {
    CAN_MODULE_USER = 0x00,       ///< between host and program
    CAN_FORWARD_IR_MESSAGE,       ///< repeat an infrared message on all cells, in two parts
    CAN_FORWARD_IR_MESSAGE_STOP,  ///< stop that, IDLE
    CAN_KILO_BOOTPAGE,            ///< six bytes of a page of the robots' program
    CAN_KILO_BOOTPAGE_SIZE,       ///< how many pages it has
    CAN_KILO_BOOTPAGE_NUMBER,     ///< which page comes next
    CAN_MODULE_BOOT,              ///< enter the boot loader
    CAN_MODULE_BOOTPAGE,          ///< likewise for the module's own program
    CAN_MODULE_BOOTPAGE_SIZE,
    CAN_MODULE_BOOTPAGE_NUMBER,
    CAN_MODULE_KILOBOT_SETUP,    ///< ignored
    CAN_MODULE_IDLE,             ///< stop the program, IDLE
    CAN_MODULE_SETUP,            ///< run setup()
    CAN_MODULE_RUN,              ///< send RUN to the robots, then run loop()
    CAN_MODULE_PAUSE,            ///< ignored
    CAN_MODULE_CONFIG_SIZE,      ///< bytes of the configuration that follows
    CAN_MODULE_CONFIG_TRANSFER,  ///< six bytes of it
    CAN_TRACKING_KILOBOT,        ///< to the host: a record, see serialize_tracking_message()
    CAN_KILOBOT_DATA,            ///< between host and program
    CAN_MODULE_DATA,             ///< a request for the module's health, and the answer
    CAN_TRACKING_KILOBOT_START,  ///< to the host: how many records follow
    CAN_TRACKING_REQ,            ///< a poll
    CAN_MODULE_TO_MODULE,  ///< by custom between programs of modules; not known to the runtime
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

/// Makes a frame of eight data bytes, all zero. Call it before the fields are filled in.
void init_CAN_message(CAN_message_t *message);

/// Sends now, to modules or (ADDR_DISPATCHER, with the module's own x and y) to the host; fills in
/// the id. 1 if the controller took it, else 0.
uint8_t CAN_message_tx(CAN_message_t *message, kilogrid_address_t to);

/// Sends a copy to all modules after loop() has come back; a second one before then replaces it.
void CAN_send_broadcast_message(CAN_message_t *message);

/// The address in the id of a received message: the modules it was for, or, of one to the host, its
/// sender.
kilogrid_address_t get_coord_from_CAN_ID(CAN_message_t *message);

/// Fills a tracking record: what a robot reported through `cell` (0..3).
void serialize_tracking_message(CAN_message_t *message, uint8_t cell, tracking_user_data_t *data);

#ifdef __cplusplus
}
#endif

#endif
