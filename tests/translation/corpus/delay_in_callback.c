// Shows each message for 20 ms within the callback: ticks and messages go by meanwhile.
#include <kilolib.h>

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    set_color(RGB(1 + (message->data[0] & 1), 0, 0));
    delay(20);
    set_color(0);
}

static void setup(void) {}
static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
