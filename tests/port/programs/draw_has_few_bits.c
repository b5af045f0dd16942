// expect: few-bits 7
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    if (rand_soft() % 1000 == 0) set_color(RGB(0, 1, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
