// How many messages came in the last second.
#include <kilolib.h>

static volatile uint8_t heard;
static uint32_t second;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
}

static void loop(void) {
    if (kilo_ticks - second < TICKS_PER_SEC) return;
    second += TICKS_PER_SEC;
    set_color(heard > 5 ? RGB(0, 0, 1) : heard > 1 ? RGB(0, 1, 0) : RGB(1, 0, 0));
    heard = 0;
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
