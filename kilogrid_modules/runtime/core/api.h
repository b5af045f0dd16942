/// Bodies of API functions that the chip's runtime and the emulator's guests share: what needs
/// neither registers nor the engine.
///
/// To be included by the files that define the API's functions, not together with address.h, which
/// has the names of kilogrid.h as well.
#ifndef MODULE_CORE_API_H
#define MODULE_CORE_API_H

#include <string.h>

#include "../include/CAN.h"

/// init_CAN_message(): eight data bytes, all zero.
static inline void api_init_can_message(CAN_message_t *message) {
    message->header.rtr = 0;
    message->header.length = CAN_MESSAGE_SIZE;
    memset(message->data, 0, sizeof message->data);
}

/// serialize_tracking_message(): type and cell, 0..3, share the first byte; seven bytes follow.
static inline void api_fill_record(CAN_message_t *message, uint8_t cell,
                                   const tracking_user_data_t *data) {
    const uint8_t cell_shift = 6, cell_mask = 3;
    api_init_can_message(message);
    message->data[0] = (uint8_t)(CAN_TRACKING_KILOBOT | (cell & cell_mask) << cell_shift);
    memcpy(message->data + 1, data->byte, sizeof data->byte);
}

/// get_random(): low..high - 1 from `drawn`, libc's rand(). By 16-bit arithmetic, whatever the
/// bounds.
static inline uint16_t api_in_range(uint16_t low, uint16_t high, int drawn) {
    return (uint16_t)(low + (uint16_t)drawn % (uint16_t)(high - low));
}

#endif
