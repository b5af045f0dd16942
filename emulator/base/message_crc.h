/// The CRC of Kilobot messages: CRC-16/MCRF4XX (hardware.md 1.5).
#ifndef KILOTWIN_BASE_MESSAGE_CRC_H
#define KILOTWIN_BASE_MESSAGE_CRC_H

#include <cstddef>
#include <cstring>

#include "message.h"

namespace kilotwin {

/// The CRC of any bytes: polynomial 0x8408 (reflected), start 0xFFFF, no final inversion.
uint16_t crc_of(const uint8_t *bytes, size_t count);

/// The CRC of a message's data and type, which belongs into its field `crc`.
uint16_t crc_of(const message_t &message);

/// Whether a message's field `crc` is right: receivers drop it otherwise.
bool crc_is_right(const message_t &message);

/// The last message of a sender, and whether its CRC is right. Most senders repeat themselves, so
/// the CRC is computed only when the message changes.
class CheckedMessage {
  public:
    /// Sets the last message. A comparison, and a CRC of 10 bytes if it differs.
    void say(const message_t &message) {
        if (std::memcmp(&message, &message_, sizeof message) == 0) return;
        message_ = message;
        right_ = kilotwin::crc_is_right(message);
    }
    /// The last message; all zero before the first.
    const message_t &message() const { return message_; }
    /// Whether a receiver takes it.
    bool crc_is_right() const { return right_; }

  private:
    message_t message_ = {};                   ///< the last one
    bool right_ = kilotwin::crc_is_right({});  ///< of message_
};

}  // namespace kilotwin

#endif
