// A file of its own: a program may bring its own message_crc().
#include "message_crc.h"

#include <stddef.h>

// CRC-16/MCRF4XX over the data and the type (hardware.md 1.5).
uint16_t message_crc(const message_t *message) {
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < offsetof(message_t, crc); i++) {
        uint8_t byte = (uint8_t)(((const uint8_t *)message)[i] ^ crc);
        byte ^= (uint8_t)(byte << 4);
        crc = (uint16_t)(((uint16_t)byte << 8 | crc >> 8) ^ (uint8_t)(byte >> 4) ^
                         (uint16_t)(byte << 3));
    }
    return crc;
}
