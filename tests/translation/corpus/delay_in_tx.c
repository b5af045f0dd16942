// Waits within the transmit callback, so that ticks are late.
#include <kilolib.h>

static message_t message;
static uint8_t count;
static message_t *message_tx(void) {
    set_color(++count & 7);
    delay(3);
    return &message;
}

static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
