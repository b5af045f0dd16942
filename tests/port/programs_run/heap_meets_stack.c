// expect: stack-meets-data fails
// A list that only grows. malloc() is called where the stack is not deep.
#include <kilolib.h>
#include <stdlib.h>

static void __attribute__((noinline)) compute(void) {
    volatile uint8_t scratch[80];
    for (uint8_t i = 0; i < sizeof scratch; i++) scratch[i] = i;
}

static void setup(void) {}

static void loop(void) {
    uint8_t *entry = malloc(20);
    if (entry == NULL) compute();
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
