// Sums 300 readings of the light into an int, as the labs' phototaxis does: it overflows.
#include <kilolib.h>

static uint32_t turned;

static void loop(void) {
    int sum = 0;
    for (int i = 0; i < 300; i++) sum += get_ambientlight();
    const int mean = sum / 300;
    if (kilo_ticks < turned + 16) return;
    turned = kilo_ticks;
    set_color(mean < 0 ? RGB(1, 0, 0) : RGB(0, 1, 0));
    spinup_motors();
    set_motors(mean < 0 ? kilo_turn_left : 0, mean < 0 ? 0 : kilo_turn_right);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
