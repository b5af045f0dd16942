// Counts passes from one message to the next.
#include <kilolib.h>

static volatile uint8_t is_new;
static uint16_t passes;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    is_new = 1;
}

static void loop(void) {
    passes++;
    if (!is_new) return;
    is_new = 0;
    set_color(passes >> 11 & 63);
    passes = 0;
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
