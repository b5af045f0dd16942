// expect: stops fails
// A pointer that was never set.
#include <kilolib.h>

static uint8_t *volatile table = (uint8_t *)0x2340;

static void setup(void) {}
static void loop(void) {
    delay(1000);
    table[5]++;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
