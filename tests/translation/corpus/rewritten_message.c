// Rewrites its message in each pass, also while it is on air.
#include <kilolib.h>

static message_t message;
static uint32_t last;

static message_t *message_tx(void) { return &message; }

static void loop(void) {
    if (kilo_ticks == last) return;
    last = kilo_ticks;
    message.data[0] = (uint8_t)(last / 16);
    message.crc = message_crc(&message);
    set_color(message.data[0] & 7);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
