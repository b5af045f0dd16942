// Counts its passes in a local that nothing has set, where the last pass has left it: a mistake,
// but each pass changes something, though all of it lies below the main loop's stack.
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    volatile uint8_t room[40];
    room[35]++;
    set_color(room[35] & 64 ? RGB(0, 1, 0) : RGB(1, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
