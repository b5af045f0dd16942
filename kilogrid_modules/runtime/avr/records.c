#include "records.h"

#include <util/atomic.h>

#include "../core/api.h"
#include "module.h"

record_store_t runtime_records;
static CAN_message_t slots[CAN_MESSAGE_BUFFER_SIZE];

// Programs call it from the infrared interrupt as well as from loop().
CAN_message_t *next_CAN_message(void) {
    uint8_t place = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { place = record_store_add(&runtime_records); }
    return place == RECORD_STORE_FULL ? NULL : &slots[place];
}

CAN_message_t runtime_records_take(void) {
    // Copied before its place is free: an interrupt may fill it at once.
    const CAN_message_t record = slots[runtime_records.first];
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { (void)record_store_take(&runtime_records); }
    return record;
}

void init_CAN_message(CAN_message_t *message) { api_init_can_message(message); }

void serialize_tracking_message(CAN_message_t *message, uint8_t cell, tracking_user_data_t *data) {
    api_fill_record(message, cell, data);
}
