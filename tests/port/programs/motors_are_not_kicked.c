// expect: no-kick 7
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    set_motors(kilo_straight_left, kilo_straight_right);
    delay(1000);
    set_motors(0, 0);
    delay(1000);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
