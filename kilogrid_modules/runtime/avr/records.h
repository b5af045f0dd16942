/// Tracking records that wait for the host's next poll (next_CAN_message() is how programs add
/// one).
#ifndef MODULE_AVR_RECORDS_H
#define MODULE_AVR_RECORDS_H

#include <stdint.h>

#include "CAN.h"

void runtime_records_clear(void);
uint8_t runtime_records_waiting(void);

/// Takes out the oldest; to be called only if one waits.
CAN_message_t runtime_records_take(void);

/// For which there was no place, since power-up; stays at 255.
uint8_t runtime_records_lost(void);

#endif
