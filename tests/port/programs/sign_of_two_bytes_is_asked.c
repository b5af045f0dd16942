// expect: int-width 12
#include <kilolib.h>

static volatile uint8_t wanted;

static void setup(void) {}

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    const uint8_t *data = message->data;
    // 15 bits and a sign on the robot; always positive here.
    int id = (data[0] << 8) | data[1];
    if (id >= 0)
        wanted = 1;
    else
        wanted = 2;
}

static void loop(void) { set_color(wanted); }

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
