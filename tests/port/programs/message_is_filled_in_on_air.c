// expect: message-race 12
#include <kilolib.h>

static message_t message;
static volatile uint8_t steps;

static message_t *on_transmit(void) { return &message; }

static void setup(void) { message.type = NORMAL; }

static void loop(void) {
    message.data[0] = steps;
    message.data[1] = 255 - steps;
    message.crc = message_crc(&message);
    steps++;
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_message_tx = on_transmit;
    kilo_start(setup, loop);
    return 0;
}
