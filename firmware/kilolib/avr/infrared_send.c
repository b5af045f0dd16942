#include "infrared_send.h"

#include "board.h"
#include "calibration.h"
#include "frame_sender.h"
#include "infrared_receive.h"

static uint8_t pins;

void kilolib_infrared_send_init(void) {
    pins = kilolib_calibration_infrared_pins();
    PORTB &= (uint8_t)~pins;
    DDRB |= pins;
}

bool kilolib_infrared_send(const message_t *message) {
    const bool sent = kilolib_infrared_send_frame(message, pins);
    kilolib_infrared_forget_edge();
    return sent;
}
