/// The program that a robot has before it gets another one: its loop() turns the LED red.
#include <kilolib.h>

static void setup(void) {}
static void loop(void) { set_color(RGB(3, 0, 0)); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
