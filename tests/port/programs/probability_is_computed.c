// expect: few-bits 18
#include <kilolib.h>
#include <math.h>

static volatile uint8_t neighbours;

static double uniform(void) { return (double)rand_hard() / 255; }

static double chance_to_leave(uint8_t others) {
    if (kilo_uid == 0) return 0;
    return 0.5 * exp(-2.25 * others);
}

static void setup(void) {}

static void loop(void) {
    const double drawn = uniform();
    if (drawn <= chance_to_leave(neighbours)) set_color(RGB(0, 1, 0));
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
