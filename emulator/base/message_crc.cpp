#include "base/message_crc.h"

#include <array>

namespace kilotwin {

namespace {

// The change of the CRC by each value of its low half; the polynomial is 0x8408.
constexpr std::array<uint16_t, 256> TABLE = [] {
    std::array<uint16_t, 256> table{};
    for (uint32_t i = 0; i < 256; i++) {
        auto byte = static_cast<uint8_t>(i ^ i << 4);  // eight bits at once
        table[i] = static_cast<uint16_t>(byte << 8 ^ byte >> 4 ^ byte << 3);
    }
    return table;
}();

}  // namespace

uint16_t crc_of(const uint8_t *bytes, size_t count) {
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < count; i++)
        crc = static_cast<uint16_t>(crc >> 8 ^ TABLE[(bytes[i] ^ crc) & 0xFF]);
    return crc;
}

uint16_t crc_of(const message_t &message) {
    return crc_of(reinterpret_cast<const uint8_t *>(&message), offsetof(message_t, crc));
}

bool crc_is_right(const message_t &message) { return crc_of(message) == message.crc; }

}  // namespace kilotwin
