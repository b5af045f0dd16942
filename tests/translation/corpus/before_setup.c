// Counts what comes before setup(), where upstream kilolib hands messages on as well.
#include <kilolib.h>

static volatile uint16_t received;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    received++;
}

static void setup(void) { set_color(received & 63); }
static void loop(void) { set_color((received >> 1) & 63); }

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
