#include "infrared_send.h"

#include "board.h"
#include "calibration.h"
#include "infrared_frame.h"
#include "infrared_receive.h"

static uint8_t pins;

void infrared_send_init(void) {
    pins = calibration_infrared_pins();
    PORTB &= (uint8_t)~pins;
    DDRB |= pins;
}

bool infrared_send(const message_t *message) {
    const bool sent = infrared_send_frame(message, pins);
    infrared_forget_edge();
    return sent;
}
