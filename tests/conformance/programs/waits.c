/// Takes its time from delay(), which on the robot is longer by what interrupts take.
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    set_color(RGB(0, 0, 1));
    delay(100);
    set_color(RGB(0, 0, 0));
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
