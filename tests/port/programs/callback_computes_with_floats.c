// expect: float-in-interrupt 8
#include <kilolib.h>

static volatile uint8_t shown;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    shown = (uint8_t)(message->data[0] / 3.7);
}

static void setup(void) {}
static void loop(void) { set_color(shown); }

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
