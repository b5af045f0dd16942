// Walks at random, and computes with floats: what a neighbour does to its processor would show.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static uint32_t next_turn;
static double sum = 1;
static long double wide = 1;

static void setup(void) { next_turn = rand_hard() % 32; }

static void loop(void) {
    sum = sum / 3 + 1e-3 * rand_soft();
    wide = wide / 3 + (long double)sum;
    if (kilo_ticks < next_turn) return;
    next_turn = kilo_ticks + 16 + rand_hard() % 32;
    const uint8_t way = rand_hard() % 3;
    spinup_motors();
    set_motors(way == 0 ? 0 : kilo_straight_left, way == 1 ? 0 : kilo_straight_right);
    set_color(RGB(way, 1, 0));
    printf("%.17g %.17g\n", sum, (double)wide);
}

int main(void) {
    kilo_init();
    debug_init();
    kilo_start(setup, loop);
    return 0;
}
