// expect: int-overflow warns 10
// Fuel in 16 bits without a sign, in an int of 32 bits here.
#include <kilolib.h>

static unsigned fuel;

static void setup(void) {}

static void loop(void) {
    fuel += 9000;
    if (fuel == 1) set_color(RGB(1, 0, 0));
    delay(250);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
