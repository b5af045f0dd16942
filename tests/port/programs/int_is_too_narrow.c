// expect: int-width 9
#include <kilolib.h>

static volatile uint32_t wait_ms;

static void setup(void) {}

static void loop(void) {
    wait_ms = 60 * 1000;
    if (wait_ms > 50000) set_color(RGB(3, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
