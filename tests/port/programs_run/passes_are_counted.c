// expect: differs-in-passes fails
// It blinks by passes of loop().
#include <kilolib.h>

static uint16_t passes;

static void setup(void) {}

static void loop(void) {
    passes++;
    if (passes > 20000) {
        set_color(RGB(1, 0, 0));
        if (passes > 40000) passes = 0;
    } else {
        set_color(RGB(0, 1, 0));
    }
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
