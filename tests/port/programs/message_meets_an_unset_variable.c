// expect: before-setup 12
#include <kilolib.h>

static volatile uint8_t nearest, colour;

static void on_message(message_t *message, distance_measurement_t *distance) {
    const uint8_t mm = estimate_distance(distance);
    if (mm < nearest) colour = message->data[0];
}

static void setup(void) {
    nearest = 100;
    colour = 0;
}

static void loop(void) { set_color(colour); }

int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
