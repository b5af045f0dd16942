// A body that should run once a tick and runs in every pass of it.
#include <kilolib.h>

static uint16_t runs;

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks % 32 == 0) runs++;
    set_color((runs >> 12) & 7);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
