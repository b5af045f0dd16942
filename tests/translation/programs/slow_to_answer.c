// Takes 2,000 cycles for its message, in the tick's interrupt, and sends often. The interrupt
// outlasts the moment at which the channel is known to be busy, and then draws when to try again.
#include <kilolib.h>
#include <util/delay.h>

static message_t said;
static volatile uint8_t heard;

static message_t *say(void) {
    _delay_us(250);
    return &said;
}

static void hear(message_t *message, distance_measurement_t *measured) { heard++; }

static void setup(void) {
    said.crc = message_crc(&said);
    kilo_tx_period = 600;
}

static void loop(void) { set_color(heard >> 2 & 63); }

int main(void) {
    kilo_init();
    kilo_message_tx = say;
    kilo_message_rx = hear;
    kilo_start(setup, loop);
    return 0;
}
