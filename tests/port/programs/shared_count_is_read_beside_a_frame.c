// expect: torn-access 18
// The frame of `seen` makes the compiler switch interrupts off, around its own write to SP only.
#include <kilolib.h>

static volatile uint16_t heard;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
}

static void setup(void) { kilo_message_rx = on_message; }

static void loop(void) {
    volatile uint8_t seen[40];
    for (uint8_t i = 0; i < sizeof seen; i++) seen[i] = i;
    const uint16_t count = heard;
    set_color(seen[count % sizeof seen] & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
