/// Switches the LED off and on again in each pass.
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    set_color(RGB(0, 0, 0));
    set_color(kilo_ticks % 64 < 32 ? RGB(1, 0, 0) : RGB(0, 0, 1));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
