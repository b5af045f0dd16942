// Colours by kilolib's random numbers, again from the same seed after a while.
#include <kilolib.h>

static uint8_t drawn;

static void loop(void) {
    if (drawn++ == 40) {
        drawn = 0;
        rand_seed(0x5A);
    }
    set_color(rand_soft() & 63);
    delay(110);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
