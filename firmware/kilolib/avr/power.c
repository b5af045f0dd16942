#include "power.h"

#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "infrared_send.h"

static void release_pins(void) {
    DDRB = DDRC = DDRD = 0;
    PORTB = PORTC = PORTD = 0;
}

void power_on(void) {
    release_pins();
    DDRD = RECEIVER_POWER;
    PORTD = RECEIVER_POWER;
    infrared_send_init();
    converter_init();
    infrared_receive_init();
}

void power_off(void) {
    infrared_receive_stop();
    converter_stop();
    release_pins();
}
