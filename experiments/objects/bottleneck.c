/// Goes to the light, and shows when it has come as far as where a wall had a gap.
///
/// LED: green on its way, blue once it has read THROUGH or more.
#include "climb.h"

#ifndef THROUGH
#define THROUGH 570  // the light behind the gap, of 1023
#endif
#define NOISE_SUM 12  // of eight readings of the light

static void setup(void) {
    rand_seed(rand_hard());
    set_color(RGB(0, 3, 0));
    turn(rand_soft() & 1);
}

static void loop(void) {
    static uint32_t last_tick;
    const uint32_t now = ticks_now();
    uint16_t light;
    if (now == last_tick) return;
    last_tick = now;
    if (!sum_light(&light)) return;
    if (light >= 8 * THROUGH) set_color(RGB(0, 0, 3));
    climb(light, NOISE_SUM);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
