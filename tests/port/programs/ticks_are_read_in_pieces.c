// expect: torn-access 9
#include <kilolib.h>

static uint32_t last;

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks - last > 32) {
        last += 32;
        set_color(rand_soft());
    }
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
