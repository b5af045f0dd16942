// Does one of four things by its number.
#include <kilolib.h>

static uint32_t last;

static void loop(void) {
    switch ((kilo_uid + kilo_ticks / 64) % 4) {
    case 0: set_color(RGB(1, 0, 0)); break;
    case 1: set_color(RGB(0, 1, 0)); break;
    case 2: set_motors(kilo_ticks - last > 40 ? 0 : kilo_turn_left, 0); break;
    default: last = kilo_ticks;
    }
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
