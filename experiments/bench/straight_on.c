/// Drives straight on for ever: what `kilotwin bench squeeze` presses together.
#include <kilolib.h>

static void setup(void) {
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
