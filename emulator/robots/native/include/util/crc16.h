/// Checksums, a byte at a time. Known as: _crc16_update CRC-16/ARC from 0, MODBUS from 0xFFFF;
/// _crc_xmodem_update CRC-16/XMODEM from 0; _crc_ccitt_update CRC-16/MCRF4XX from 0xFFFF, which
/// message_crc() is too; _crc_ibutton_update CRC-8/MAXIM from 0; _crc8_ccitt_update CRC-8 from 0.
#ifndef KT_UTIL_CRC16_H
#define KT_UTIL_CRC16_H

#include <stdint.h>

/// Lowest bit first.
static inline uint16_t kt_crc_right(uint16_t crc, uint16_t polynomial) {
    for (uint8_t bit = 0; bit < 8; bit++) {
        crc = (uint16_t)(crc & 1 ? crc >> 1 ^ polynomial : crc >> 1);
    }
    return crc;
}

/// Highest bit first.
static inline uint16_t kt_crc_left(uint16_t crc, uint16_t polynomial) {
    for (uint8_t bit = 0; bit < 8; bit++) {
        crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ polynomial : crc << 1);
    }
    return crc;
}

static inline uint16_t _crc16_update(uint16_t crc, uint8_t byte) {
    return kt_crc_right(crc ^ byte, 0xA001);
}

static inline uint16_t _crc_ccitt_update(uint16_t crc, uint8_t byte) {
    return kt_crc_right(crc ^ byte, 0x8408);
}

static inline uint16_t _crc_xmodem_update(uint16_t crc, uint8_t byte) {
    return kt_crc_left((uint16_t)(crc ^ byte << 8), 0x1021);
}

static inline uint8_t _crc_ibutton_update(uint8_t crc, uint8_t byte) {
    return (uint8_t)kt_crc_right(crc ^ byte, 0x8C);
}

static inline uint8_t _crc8_ccitt_update(uint8_t crc, uint8_t byte) {
    return (uint8_t)(kt_crc_left((uint16_t)((crc ^ byte) << 8), 0x0700) >> 8);
}

#endif
