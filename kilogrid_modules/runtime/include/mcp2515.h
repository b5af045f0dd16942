/// The CAN message as module programs have it; named for the controller that carries it.
#ifndef MCP2515_H
#define MCP2515_H

#include <stdint.h>

/// Data bytes of a frame at most.
#define CAN_MESSAGE_SIZE 8
/// data[0] is the type and data[1] a sequence number, the rest is payload.
#define CAN_MESSAGE_PAYLOAD (CAN_MESSAGE_SIZE - 2)

/// A frame, received or to be sent. The runtime fills in `id`; programs fill in data and length
/// (init_CAN_message() sets it to 8).
typedef struct {
    uint16_t id;  ///< 11 bits; filled in when sent
    struct {
        uint8_t rtr : 1;     ///< 0: a data frame
        uint8_t length : 4;  ///< data bytes, 0..8
    } header;
    uint8_t data[CAN_MESSAGE_SIZE];
} CAN_message_t;

#endif
