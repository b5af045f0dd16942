// expect: torn-access 9
#include <kilolib.h>

static uint32_t last, blink;

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks > last) set_color(RGB(1, 0, 0));
    if (rand_soft() > 200) last = kilo_ticks;
    if (rand_soft() > 100) blink = kilo_ticks + 5;
    if (blink > last) set_color(RGB(0, 1, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
