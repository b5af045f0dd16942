// expect: stack 11
#include <kilolib.h>

static uint8_t heard[8];
static volatile uint8_t told;

static void setup(void) {}

static void loop(void) {
    uint8_t length = (uint8_t)(100 + (get_ambientlight() & 127));
    uint8_t reversed[length];
    for (uint8_t i = 0; i < length; i++) reversed[i] = heard[(length - 1 - i) & 7];
    told = reversed[told & 63];
    delay(50);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
