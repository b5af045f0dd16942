// Waits within loop() for a message, with a bound.
#include <kilolib.h>

static volatile uint8_t count;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    count++;
}

static void loop(void) {
    const uint8_t before = count;
    const uint32_t until = kilo_ticks + 25;
    while (count == before && kilo_ticks < until) {
    }
    set_color(count == before ? RGB(1, 0, 0) : RGB(0, 1, 0));
    delay(30);
    set_color(0);
    delay(30);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
