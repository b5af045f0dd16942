// Shows the raw gains of each message.
#include <kilolib.h>

static volatile int16_t low, high;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    low = distance->low_gain;
    high = distance->high_gain;
}

static void loop(void) { set_color((high >> 7 & 3) | (low >> 7 & 3) << 2); }

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
