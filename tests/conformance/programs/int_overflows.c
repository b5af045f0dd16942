/// Counts in an int beyond 32,767, where 16 bits end.
#include <kilolib.h>

static volatile int total;
static uint32_t last;

static void setup(void) {}

static void loop(void) {
    const uint32_t now = kilo_ticks;
    if (now == last) return;
    last = now;
    total += 100;
    set_color(total > 0 && total % 1000 == 0 ? RGB(1, 0, 0) : RGB(0, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
