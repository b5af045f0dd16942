// expect: no-return 7
#include <kilolib.h>

static uint8_t parity_of(uint8_t uid) {
    if (uid & 1) return 1;
    if (uid & 2) return 2;
}

static void setup(void) {}

static void loop(void) { set_color(parity_of((uint8_t)kilo_uid)); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
