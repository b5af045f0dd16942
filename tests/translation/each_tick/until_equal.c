// Reads kilo_ticks until two reads agree, with code between that a tick may come into, works once
// for each, and looks at them once more. Its LED shows at which cycle it changes.
#include <avr/io.h>
#include <kilolib.h>

static uint32_t last, next_change = 40, next_turn = 50;

static void __attribute__((noinline)) show(void) {
    const uint8_t cycle = TCNT1L;
    set_color(RGB(cycle & 3, cycle >> 2 & 3, cycle >> 4 & 3));
}

static uint32_t __attribute__((noinline)) ticks_now(void) { return kilo_ticks; }

static void setup(void) {}

static void loop(void) {
    uint32_t now = ticks_now();
    while (now != ticks_now()) now = ticks_now();
    if (now != last) {
        last = now;
        if (now >= next_change) {
            next_change = now + 20 + (rand_soft() & 15);
            show();
        }
    }
    if (kilo_ticks < next_turn) return;
    next_turn = kilo_ticks + 31;
    set_motors(kilo_uid + next_turn, TCNT1L);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
