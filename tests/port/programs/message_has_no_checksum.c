// expect: no-crc 16
#include <kilolib.h>

static message_t message;

static message_t *on_transmit(void) { return &message; }

static void setup(void) {
    message.type = NORMAL;
    message.data[0] = 7;
}

static void loop(void) {}

int main(void) {
    kilo_message_tx = on_transmit;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
