/// Reads the light in each pass, and shows by the LED whether it is bright.
#include <kilolib.h>

static void setup(void) {}

static void loop(void) { set_color(get_ambientlight() > 500 ? RGB(1, 0, 0) : RGB(0, 1, 0)); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
