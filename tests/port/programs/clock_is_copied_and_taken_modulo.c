// expect: tick-modulo 10
#include <kilolib.h>

static uint16_t update = 32;

static void setup(void) { set_color(0); }

static void loop(void) {
    const uint16_t now = kilo_ticks;
    if ((now / 32) % 60 == 0) update += 4;
    set_color(update & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
