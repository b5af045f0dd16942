/// Tracking records on the chip: the memory around core/record_store.h (next_CAN_message() is how
/// programs add one).
#ifndef MODULE_AVR_RECORDS_H
#define MODULE_AVR_RECORDS_H

#include "../core/record_store.h"
#include "CAN.h"

/// The store; what waits and what was lost may be read at any time.
extern record_store_t runtime_records;

/// Takes the oldest record out. From the main loop, only while one waits.
CAN_message_t runtime_records_take(void);

#endif
