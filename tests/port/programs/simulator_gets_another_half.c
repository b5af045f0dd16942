// expect: two-programs 7
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
#ifdef SIMULATION
    set_color(RGB(1, 0, 0));
#else
    set_color(RGB(0, 1, 0));
    delay(10);
#endif
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
