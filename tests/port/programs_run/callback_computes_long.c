// expect: long-callback warns 7
// Adds up 100 ms long whatever it has heard.
#include <kilolib.h>

static volatile uint16_t sum;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    for (uint16_t i = 0; i < 10800; i++) sum = (uint16_t)(sum * 31 + message->data[i % 9]);
}

static void setup(void) {}
static void loop(void) {}

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
