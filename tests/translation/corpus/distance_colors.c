// Shows how far the last sender is, by floats.
#include <kilolib.h>

static volatile uint8_t millimetres;
static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    millimetres = estimate_distance(distance);
}

static void setup(void) {}

static void loop(void) {
    set_color(millimetres > 90 ? RGB(1, 0, 0) : millimetres > 60 ? RGB(0, 1, 0) : RGB(0, 0, 1));
}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
