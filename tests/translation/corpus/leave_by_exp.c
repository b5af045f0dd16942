// Leaves with a probability that falls with the neighbours heard.
#include <kilolib.h>
#include <math.h>

static volatile uint8_t heard;
static uint8_t is_here;
static uint32_t last;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
}

static void loop(void) {
    if (kilo_ticks < last + 20) return;
    last = kilo_ticks;
    const double leave = exp(-0.35 * heard);
    heard = 0;
    if (rand_soft() < leave * 255) is_here = !is_here;
    set_color(is_here ? RGB(1, 1, 0) : RGB(0, 0, 1));
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
