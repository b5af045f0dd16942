// expect: int-width 10
#include <kilolib.h>

static uint16_t seen = UINT16_MAX;

static void setup(void) {}

static void loop(void) {
    // On the robot -1 becomes 65535.
    if (seen == -1) seen = rand_soft();
    set_color(seen & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
