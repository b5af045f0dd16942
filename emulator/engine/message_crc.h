/// The check of a Kilobot message, as receivers make it.
#ifndef KILOTWIN_ENGINE_MESSAGE_CRC_H
#define KILOTWIN_ENGINE_MESSAGE_CRC_H

#include "message.h"

namespace kilotwin {

/// Whether the message carries the CRC-16/MCRF4XX of its data and type (hardware.md 1.5).
bool crc_is_right(const message_t &message);

}  // namespace kilotwin

#endif
