// expect: no-kick fails 12
// There is a kick in the program, but of 5 ms.
#include <kilolib.h>

static uint8_t moves;

static void setup(void) {}

static void drive(void) {
    if (moves) return;
    moves = 1;
    set_motors(255, 255);
    delay(5);
    set_motors(kilo_straight_left, kilo_straight_right);
}

static void loop(void) { drive(); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
