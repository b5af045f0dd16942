#include "infrared_send.h"

#include "../core/calibration.h"
#include "../core/eeprom_map.h"
#include "board.h"
#include "frame_sender.h"
#include "infrared_receive.h"

static uint8_t pins;

// Those of the EEPROM map if there are such pins, else PB0.
static uint8_t connected_pins(void) {
    const uint8_t saved = kilolib_eeprom_read(EEPROM_INFRARED_PINS);
    const bool legal = saved != 0 && (saved & (uint8_t)~INFRARED_PINS) == 0;
    return legal ? saved : INFRARED_DEFAULT_PIN;
}

void kilolib_infrared_send_init(void) {
    pins = connected_pins();
    PORTB &= (uint8_t)~pins;
    DDRB |= pins;
}

bool kilolib_infrared_send(const message_t *message) {
    const bool sent = kilolib_infrared_send_frame(message, pins);
    kilolib_infrared_forget_edge();
    return sent;
}
