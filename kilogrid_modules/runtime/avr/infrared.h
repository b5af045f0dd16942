/// Driver of the cells' infrared: one transmitter and one receiver behind multiplexers.
///
/// Reception runs in interrupts of the comparator and of timer 1; a message goes to the program's
/// callback from there. The API's functions of moduleIR.h are here as well.
#ifndef MODULE_AVR_INFRARED_H
#define MODULE_AVR_INFRARED_H

#include <stdbool.h>
#include <stdint.h>

#include "message.h"

/// Reads the gain tables from the EEPROM and switches the receiver on, at cell 0.
void runtime_infrared_init(void);

/// Whether a frame is coming in.
bool runtime_infrared_receiving(void);

/// Ends a dwell: the receiver goes to the next cell, unless a frame is coming in.
void runtime_infrared_listen_to_next_cell(void);

typedef enum {
    INFRARED_SENT,
    INFRARED_BUSY,       ///< carrier sense saw light: not sent
    INFRARED_RECEIVING,  ///< a frame is coming in: not even tried
} infrared_attempt_t;

/// Sends a message by `cell`, 0..3, as it is, crc included: 4.4 ms with interrupts off.
infrared_attempt_t runtime_infrared_send_by(uint8_t cell, const message_t *message);

/// Turn of `cell`: sends the message that it repeats. INFRARED_SENT also if it has none.
infrared_attempt_t runtime_infrared_repeat(uint8_t cell);

/// Stops all cells' repetitions.
void runtime_infrared_silence(void);

#endif
