// Waits for the clock in loops of its own.
#include <kilolib.h>

// A byte of the clock: of more, an interrupt may come between two.
static void wait_for(uint8_t ticks) {
    const uint8_t since = (uint8_t)kilo_ticks;
    while ((uint8_t)((uint8_t)kilo_ticks - since) < ticks) {
    }
}

static void setup(void) {}

static void loop(void) {
    set_motors(kilo_straight_left, kilo_straight_right);
    set_color(RGB(0, 1, 0));
    wait_for(31);
    set_motors(0, 0);
    set_color(RGB(1, 0, 0));
    wait_for(15);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
