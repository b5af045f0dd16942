/// CRC-16/MCRF4XX (hardware.md 1.5): of messages, and of programs' images (boot_loaders.md 2).
/// Reflected polynomial 0x8408, start 0xFFFF, no final inversion. Pure, constant time.
#ifndef KILOLIB_CORE_CRC16_H
#define KILOLIB_CORE_CRC16_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A CRC that is being computed, by halves: whole bytes are what an AVR computes with. May be
/// copied, to go on from there in two ways.
typedef struct {
    uint8_t low;   ///< bits 0 to 7
    uint8_t high;  ///< bits 8 to 15
} crc16_t;

/// The CRC of no bytes.
static inline crc16_t crc16_start(void) {
    const crc16_t none = {0xFF, 0xFF};
    return none;
}

/// Takes one byte more: eight steps of the polynomial at once. Some 16 cycles on the chip.
static inline void crc16_add(crc16_t *crc, uint8_t byte) {
    uint8_t mixed = byte ^ crc->low;
    mixed ^= (uint8_t)(mixed << 4);
    crc->low = (uint8_t)(crc->high ^ mixed >> 4 ^ mixed << 3);
    crc->high = mixed ^ mixed >> 5;
}

/// The CRC of the bytes taken so far; over bytes and then their own CRC, low half first, it is 0.
static inline uint16_t crc16_value(crc16_t crc) { return (uint16_t)(crc.high << 8 | crc.low); }

#ifdef __cplusplus
}
#endif

#endif
