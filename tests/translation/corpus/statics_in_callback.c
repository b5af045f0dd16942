// Counts in variables that callbacks keep to themselves.
#include <kilolib.h>

static message_t message;
static volatile uint8_t shown;

static message_t *message_tx(void) {
    static uint8_t asked;
    message.data[0] = ++asked;
    message.crc = message_crc(&message);
    return asked & 1 ? &message : 0;
}

static void message_rx(message_t *received, distance_measurement_t *distance) {
    static uint8_t count;
    (void)received;
    (void)distance;
    shown = ++count;
}

static void loop(void) { set_color(shown & 63); }

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
