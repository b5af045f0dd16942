// expect: tick-equal 9
#include <kilolib.h>

static volatile uint8_t done;

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks == 320) done = 1;
    set_color(done);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
