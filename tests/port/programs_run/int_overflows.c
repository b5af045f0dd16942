// expect: int-overflow warns 9
// Energy that is stored, and shown only where it is large: nothing else shows that it is below 0.
#include <kilolib.h>

static int energy;

static void setup(void) {}
static void loop(void) {
    energy += 5000;
    if (energy < -32767) set_color(RGB(1, 0, 0));
    delay(250);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
