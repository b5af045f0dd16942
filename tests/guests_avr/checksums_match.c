// The checksums of <util/crc16.h> over "123456789", and the parity of a byte.
#include <util/crc16.h>
#include <util/parity.h>

#include "check.h"

static const char TEXT[] = "123456789";

static uint16_t over_text(uint16_t (*update)(uint16_t, uint8_t), uint16_t crc) {
    for (const char *c = TEXT; *c != '\0'; c++) crc = update(crc, (uint8_t)*c);
    return crc;
}

static uint16_t arc(uint16_t crc, uint8_t byte) { return _crc16_update(crc, byte); }
static uint16_t xmodem(uint16_t crc, uint8_t byte) { return _crc_xmodem_update(crc, byte); }
static uint16_t ccitt(uint16_t crc, uint8_t byte) { return _crc_ccitt_update(crc, byte); }
static uint16_t one_wire(uint16_t crc, uint8_t byte) {
    return _crc_ibutton_update((uint8_t)crc, byte);
}
static uint16_t crc_8(uint16_t crc, uint8_t byte) { return _crc8_ccitt_update((uint8_t)crc, byte); }

static void check(void) {
    CHECK(over_text(arc, 0) == 0xBB3D);
    CHECK(over_text(arc, 0xFFFF) == 0x4B37);
    CHECK(over_text(xmodem, 0) == 0x31C3);
    CHECK(over_text(ccitt, 0xFFFF) == 0x6F91);
    CHECK(over_text(one_wire, 0) == 0xA1);
    CHECK(over_text(crc_8, 0) == 0xF4);

    message_t message = {{0}, 0, 0};
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i < 9; i++) crc = _crc_ccitt_update(crc, message.data[i]);
    CHECK(_crc_ccitt_update(crc, message.type) == message_crc(&message));

    CHECK(parity_even_bit(0x07) == 1 && parity_even_bit(0x11) == 0);
}
