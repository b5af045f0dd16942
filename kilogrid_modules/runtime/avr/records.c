#include "records.h"

#include <string.h>
#include <util/atomic.h>

#include "module.h"

#define CELL_SHIFT 6
#define CELL_MASK 3

static CAN_message_t slots[CAN_MESSAGE_BUFFER_SIZE];
static uint8_t first;
static volatile uint8_t used;
static uint8_t lost;

void runtime_records_clear(void) { used = 0; }
uint8_t runtime_records_waiting(void) { return used; }
uint8_t runtime_records_lost(void) { return lost; }

// Called from the infrared interrupt as well as from the main loop.
CAN_message_t *next_CAN_message(void) {
    CAN_message_t *place = NULL;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (used < CAN_MESSAGE_BUFFER_SIZE) {
            place = &slots[(uint8_t)(first + used++) % CAN_MESSAGE_BUFFER_SIZE];
        } else if (lost < UINT8_MAX) {
            lost++;
        }
    }
    return place;
}

CAN_message_t runtime_records_take(void) {
    const CAN_message_t record = slots[first];
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        first = (uint8_t)((first + 1) % CAN_MESSAGE_BUFFER_SIZE);
        used--;
    }
    return record;
}

void init_CAN_message(CAN_message_t *message) {
    message->header.rtr = 0;
    message->header.length = CAN_MESSAGE_SIZE;
    memset(message->data, 0, sizeof message->data);
}

void serialize_tracking_message(CAN_message_t *message, uint8_t cell, tracking_user_data_t *data) {
    init_CAN_message(message);
    message->data[0] = (uint8_t)(CAN_TRACKING_KILOBOT | (cell & CELL_MASK) << CELL_SHIFT);
    memcpy(message->data + 1, data->byte, sizeof data->byte);
}
