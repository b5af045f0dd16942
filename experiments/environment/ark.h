/// Words of a virtual environment to this robot: three robots share a message of type 0, 24 bits
/// each, highest first: uid (10), type (4), value (10). See docs/environment.md.
#ifndef ARK_H
#define ARK_H

#include <kilolib.h>
#include <stdbool.h>

#define ARK_MESSAGE 0  // the message's type

typedef struct {
    uint8_t type;    // 0 to 15
    uint16_t value;  // 0 to 1023
} ark_word_t;

/// Finds this robot's word in a message; false if there is none. For kilo_message_rx.
static inline bool ark_find(const message_t *message, ark_word_t *word) {
    if (message->type != ARK_MESSAGE) return false;
    for (uint8_t i = 0; i < 9; i += 3) {
        const uint8_t *bytes = message->data + i;
        const uint16_t uid = (uint16_t)(bytes[0] << 2 | bytes[1] >> 6);
        if (uid != kilo_uid) continue;
        word->type = bytes[1] >> 2 & 0x0F;
        word->value = (uint16_t)((bytes[1] & 3) << 8 | bytes[2]);
        return true;
    }
    return false;
}

#endif
