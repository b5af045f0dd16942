// expect: torn-access 15
#include <kilolib.h>

static volatile uint16_t heard;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
}

static void setup(void) {}

static void loop(void) {
    uint16_t n = heard;
    if (n > 300) set_color(RGB(0, 3, 0));
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
