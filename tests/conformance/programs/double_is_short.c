/// Adds small numbers to a large one, which a double of 32 bits does not notice.
#include <kilolib.h>

static volatile double sum = 100000000.0;
static uint32_t last;

static void setup(void) {}

static void loop(void) {
    const uint32_t now = kilo_ticks;
    if (now == last) return;
    last = now;
    sum += 1.0;
    set_color(sum > 100000100.0 ? RGB(0, 1, 0) : RGB(0, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
