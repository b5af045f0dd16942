// Hands on the least number of hops that it has heard.
#include <kilolib.h>

static message_t message;
static volatile uint8_t hops = 250, is_new;
static message_t *message_tx(void) { return &message; }
static void message_rx(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    if (received->data[0] < hops) {
        hops = received->data[0];
        is_new = 1;
    }
}

static void setup(void) {}

static void loop(void) {
    if (is_new) {
        is_new = 0;
        message.type = NORMAL;
        message.data[0] = hops + 1;
        message.crc = message_crc(&message);
    }
    set_color(hops & 63);
}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
