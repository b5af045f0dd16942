// Keeps a distance, smoothed as a float.
#include <kilolib.h>

static volatile uint8_t distance_mm, is_new;
static float smooth = 60;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    distance_mm = estimate_distance(distance);
    is_new = 1;
}

static void loop(void) {
    if (!is_new) return;
    is_new = 0;
    smooth = 0.7f * smooth + 0.3f * distance_mm;
    if (smooth < 55.5f)
        set_motors(kilo_turn_left, 0);
    else
        set_motors(0, kilo_turn_right);
    set_color(smooth < 55.5f ? RGB(0, 1, 0) : RGB(1, 0, 0));
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
