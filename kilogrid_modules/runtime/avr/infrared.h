/// Infrared of the four cells: one transmitter and one receiver behind multiplexers.
#ifndef MODULE_AVR_INFRARED_H
#define MODULE_AVR_INFRARED_H

#include <stdbool.h>
#include <stdint.h>

#include "message.h"

/// Reads the tables of distances, switches the receiver on.
void runtime_infrared_init(void);

/// A frame is coming in.
bool runtime_infrared_receiving(void);

/// The receiver goes on to the next cell, unless a frame is coming in.
void runtime_infrared_listen_to_next_cell(void);

typedef enum {
    INFRARED_SENT,
    INFRARED_BUSY,       ///< light was seen: not sent
    INFRARED_RECEIVING,  ///< a frame is coming in: not even tried
} infrared_attempt_t;

/// Sends a message as it is, crc included, in 4.4 ms with interrupts off.
infrared_attempt_t runtime_infrared_send_by(uint8_t cell, const message_t *message);

/// Sends the message that `cell` repeats; INFRARED_SENT as well if it has none.
infrared_attempt_t runtime_infrared_repeat(uint8_t cell);

/// No cell repeats anything.
void runtime_infrared_silence(void);

#endif
