#include "engine/message_crc.h"

#include <cstddef>

namespace kilotwin {

bool crc_is_right(const message_t &message) {
    uint16_t crc = 0xFFFF;
    auto bytes = reinterpret_cast<const uint8_t *>(&message);
    for (size_t i = 0; i < offsetof(message_t, crc); i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) crc = static_cast<uint16_t>(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc == message.crc;
}

}  // namespace kilotwin
