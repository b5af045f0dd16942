// A 16-bit counter that wraps, compared as signed and as unsigned.
#include <kilolib.h>

static int counter;
static unsigned high = 40000u;

static void loop(void) {
    counter += 1111;
    high += 2222;
    set_color((counter < 0 ? 1 : 0) | (high > 40000u ? 4 : 0) |
              ((long)counter * 3 > 60000 ? 16 : 0));
    delay(35);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
