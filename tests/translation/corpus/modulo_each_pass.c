// Divides by numbers that are no powers of two, in each pass.
#include <kilolib.h>

static uint32_t passes;

static void loop(void) {
    passes++;
    const uint16_t rest = (uint16_t)(passes % 4999u);
    if (rest == 0) set_color(passes / 4999u % 64);
    if (rest == 2500) set_color(0);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
