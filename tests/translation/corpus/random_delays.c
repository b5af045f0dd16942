// Waits for random times, of both generators.
#include <kilolib.h>

static void setup(void) { rand_seed(rand_hard()); }

static void loop(void) {
    set_motors(rand_soft() & 127, rand_hard() & 127);
    delay(100 + 2 * (uint16_t)rand_soft());
    set_motors(0, 0);
    set_color(rand_soft() & 63);
    delay(50 + (uint16_t)rand_hard());
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
