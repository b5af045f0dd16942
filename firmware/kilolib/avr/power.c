#include "power.h"

#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "infrared_send.h"

static void release_pins(void) {
    DDRB = DDRC = DDRD = 0;
    PORTB = PORTC = PORTD = 0;
}

void kilolib_power_on(void) {
    release_pins();
    DDRD = RECEIVER_POWER;
    PORTD = RECEIVER_POWER;
    kilolib_infrared_send_init();
    kilolib_converter_init();
    kilolib_infrared_receive_init();
}

void kilolib_power_off(void) {
    kilolib_infrared_receive_stop();
    kilolib_converter_stop();
    release_pins();
}
