// expect: stack
#include <kilolib.h>

static volatile uint8_t sink;

static void __attribute__((noinline)) mix(const uint8_t *from) {
    uint8_t copy[1100];
    for (uint16_t i = 0; i < sizeof copy; i++) copy[i] = from[i % 8] + sink;
    sink = copy[sink];
}

static void setup(void) {}

static void loop(void) {
    uint8_t start[900];
    for (uint16_t i = 0; i < sizeof start; i++) start[i] = rand_soft();
    mix(start);
    sink += start[sink];
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
