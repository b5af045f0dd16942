// Blinks by counting passes of loop().
#include <kilolib.h>

static uint32_t passes;
static uint8_t color;

static void setup(void) {}

static void loop(void) {
    if (++passes < 60000) return;
    passes = 0;
    set_color(++color & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
