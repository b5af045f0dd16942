#include "message_crc.h"

#include <stddef.h>
#include <util/crc16.h>

uint16_t message_crc(const message_t *message) {
    const uint8_t *byte = (const uint8_t *)message;
    uint16_t crc = 0xFFFF;
    const uint8_t *end = byte + offsetof(message_t, crc);
    while (byte < end) crc = _crc_ccitt_update(crc, *byte++);
    return crc;
}
