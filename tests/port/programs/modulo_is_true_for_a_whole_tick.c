// expect: tick-modulo 15
#include <kilolib.h>

static uint8_t steps;

static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks % 1920 == 0) steps++;
    if (ticks_now() > 31) set_color(steps & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
