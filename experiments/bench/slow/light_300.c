/// Takes the mean of 300 readings of the light in each pass.
#include <kilolib.h>

static uint32_t turned;

static void setup(void) {}

static void loop(void) {
    int sum = 0;
    for (int i = 0; i < 300; i++) sum += get_ambientlight();
    const int mean = sum / 300;
    if (kilo_ticks < turned + 16) return;
    turned = kilo_ticks;
    set_color(mean < 0 ? RGB(1, 0, 0) : RGB(0, 1, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
