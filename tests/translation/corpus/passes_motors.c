// Turns by a 16-bit count of passes that overflows.
#include <kilolib.h>

static uint16_t passes;

static void setup(void) { spinup_motors(); }

static void loop(void) {
    passes++;
    if (passes == 0) set_motors(kilo_turn_left, 0);
    if (passes == 40000) set_motors(0, kilo_turn_right);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
