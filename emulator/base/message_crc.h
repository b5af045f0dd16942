/// The check of a Kilobot message: CRC-16/MCRF4XX (hardware.md 1.5).
#ifndef KILOTWIN_BASE_MESSAGE_CRC_H
#define KILOTWIN_BASE_MESSAGE_CRC_H

#include <cstddef>
#include <cstring>

#include "message.h"

namespace kilotwin {

/// Of any bytes: polynomial 0x8408 (reflected), start 0xFFFF, no final inversion.
uint16_t crc_of(const uint8_t *bytes, size_t count);

/// Of a message's data and type: what belongs into its crc.
uint16_t crc_of(const message_t &message);

/// Whether the message carries the right one.
bool crc_is_right(const message_t &message);

/// What somebody says, and whether its crc is right: worked out when it changes only.
class CheckedMessage {
  public:
    void say(const message_t &message) {
        if (std::memcmp(&message, &message_, sizeof message) == 0) return;
        message_ = message;
        right_ = kilotwin::crc_is_right(message);
    }
    const message_t &message() const { return message_; }
    bool crc_is_right() const { return right_; }

  private:
    message_t message_ = {};
    bool right_ = kilotwin::crc_is_right({});
};

}  // namespace kilotwin

#endif
