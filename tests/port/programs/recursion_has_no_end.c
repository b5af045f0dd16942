// expect: stack
#include <kilolib.h>

static uint8_t __attribute__((noinline)) depth(uint8_t n) {
    return n == 0 ? rand_soft() : depth(n - 1) + depth(n / 2);
}

static void setup(void) {}
static void loop(void) { set_color(depth(rand_hard())); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
