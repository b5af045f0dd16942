/// The check of a Kilobot message, as receivers make it.
#ifndef KILOTWIN_ENGINE_MESSAGE_CRC_H
#define KILOTWIN_ENGINE_MESSAGE_CRC_H

#include "message.h"

namespace kilotwin {

/// CRC-16/MCRF4XX of the message's data and type (hardware.md 1.5).
uint16_t crc_of(const message_t &message);

/// Whether the message carries it.
bool crc_is_right(const message_t &message);

}  // namespace kilotwin

#endif
