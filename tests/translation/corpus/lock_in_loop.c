// A lock that loop() holds for long: messages that come meanwhile are dropped.
#include <kilolib.h>

static volatile uint8_t lock, dropped, taken;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    if (lock)
        dropped++;
    else
        taken++;
}

static void loop(void) {
    lock = 1;
    for (volatile uint16_t i = 0; i < 45000; i++) {
    }
    lock = 0;
    for (volatile uint16_t i = 0; i < 35000; i++) {
    }
    set_color((taken & 3) | (dropped & 3) << 2);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
