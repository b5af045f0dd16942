// Fibonacci numbers by recursion, one more each second.
#include <kilolib.h>

static uint8_t n;
static uint32_t last;

static uint16_t fibonacci(uint8_t of) {
    return of < 2 ? of : fibonacci((uint8_t)(of - 1)) + fibonacci((uint8_t)(of - 2));
}

static void loop(void) {
    if (kilo_ticks < last + 31) return;
    last = kilo_ticks;
    n = n < 15 ? n + 1 : 0;
    set_color(fibonacci(n) & 63);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
