#include "engine/message_crc.h"

namespace kilotwin {

uint16_t crc_of(const uint8_t *bytes, size_t count) {
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < count; i++) {
        auto byte =
            static_cast<uint8_t>(bytes[i] ^ crc);  // the polynomial 0x8408, eight bits at once
        byte = static_cast<uint8_t>(byte ^ byte << 4);
        crc = static_cast<uint16_t>((byte << 8 | crc >> 8) ^ byte >> 4 ^ byte << 3);
    }
    return crc;
}

uint16_t crc_of(const message_t &message) {
    return crc_of(reinterpret_cast<const uint8_t *>(&message), offsetof(message_t, crc));
}

bool crc_is_right(const message_t &message) { return crc_of(message) == message.crc; }

}  // namespace kilotwin
