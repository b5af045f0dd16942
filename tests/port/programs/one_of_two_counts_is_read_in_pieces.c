// expect: torn-access 19
// A count read inside ATOMIC_BLOCK is whole, one read after it is not.
#include <kilolib.h>
#include <util/atomic.h>

static volatile uint16_t heard, far;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    heard++;
    far = (uint16_t)distance->low_gain;
}

static void setup(void) { kilo_message_rx = on_message; }

static void loop(void) {
    uint16_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { count = heard; }
    if (far > 300) set_color(count & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
