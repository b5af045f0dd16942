// expect: tick-modulo 9
#include <kilolib.h>

static uint8_t steps;

static void setup(void) { set_color(0); }

static void loop(void) {
    if ((kilo_ticks & 63) == 0) set_color(++steps & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
