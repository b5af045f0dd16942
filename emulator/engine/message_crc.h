/// The check of a Kilobot message: CRC-16/MCRF4XX (hardware.md 1.5).
#ifndef KILOTWIN_ENGINE_MESSAGE_CRC_H
#define KILOTWIN_ENGINE_MESSAGE_CRC_H

#include <cstddef>

#include "message.h"

namespace kilotwin {

/// Of any bytes: polynomial 0x8408 (reflected), start 0xFFFF, no final inversion.
uint16_t crc_of(const uint8_t *bytes, size_t count);

/// Of a message's data and type: what belongs into its crc.
uint16_t crc_of(const message_t &message);

/// Whether the message carries the right one.
bool crc_is_right(const message_t &message);

}  // namespace kilotwin

#endif
