#include "base/message_crc.h"

#include <array>

#include "kilolib/core/crc16.h"

namespace kilotwin {

namespace {

// Change of the CRC by each value of its low half, as the runtime's core computes it: a look-up a
// byte is faster here.
std::array<uint16_t, 256> changes() noexcept {
    std::array<uint16_t, 256> table{};
    for (size_t i = 0; i < table.size(); i++) {
        crc16_t crc = {static_cast<uint8_t>(i), 0};
        crc16_add(&crc, 0);
        table[i] = crc16_value(crc);
    }
    return table;
}
const std::array<uint16_t, 256> TABLE = changes();

}  // namespace

uint16_t crc_of(const uint8_t *bytes, size_t count) {
    uint16_t crc = crc16_value(crc16_start());
    for (size_t i = 0; i < count; i++)
        crc = static_cast<uint16_t>(crc >> 8 ^ TABLE[(bytes[i] ^ crc) & 0xFF]);
    return crc;
}

uint16_t crc_of(const message_t &message) {
    return crc_of(reinterpret_cast<const uint8_t *>(&message), offsetof(message_t, crc));
}

bool crc_is_right(const message_t &message) { return crc_of(message) == message.crc; }

}  // namespace kilotwin
