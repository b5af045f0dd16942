/// The checksum of a message (hardware.md 1.5).
#ifndef __MESSAGE_CRC_H__
#define __MESSAGE_CRC_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include "message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// CRC-16/MCRF4XX of data[0..8] and type: polynomial 0x8408 (reflected), start 0xFFFF, no final
/// inversion. Nine zeros of type 0 give 0x9C87. To be stored in `crc` before a message is sent:
/// receivers drop a message with a wrong one. May be called in callbacks.
uint16_t message_crc(const message_t *message);

#ifdef __cplusplus
}
#endif

#endif
