/// Does one thing in every second pass.
#include <kilolib.h>
#include <stdbool.h>

static bool odd;
static uint32_t last;

static void setup(void) {}

static void loop(void) {
    odd = !odd;
    if (!odd || kilo_ticks <= last + 31) return;
    last = kilo_ticks;
    set_color(RGB(1, last >> 5 & 1, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
