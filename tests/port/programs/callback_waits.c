// expect: slow-interrupt 8
#include <kilolib.h>

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    set_color(RGB(3, 0, 0));
    delay(100);
    set_color(RGB(0, 0, 0));
}

static void setup(void) {}
static void loop(void) {}

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
