// Ways to fail at tick 100, one for each uid; the tenth robot lives on.
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stdlib.h>

static uint8_t array[10];
static volatile int zero;

static int recurse(volatile int *above) {
    volatile int here[200];
    here[0] = above[0] + 1;
    return recurse(here) + here[0];
}

static void fail(void) {
    volatile int start[1] = {0};
    volatile uint8_t *bytes = array;
    switch (kilo_uid) {
    case 1: *(volatile int *)0 = 1; break;
    case 2:
        for (long i = 0;; i++) bytes[i] = 1;
    case 3:
        for (long i = 0;; i--) bytes[i] = 1;
    case 4: zero = recurse(start); break;
    case 5: exit(3);
    case 6: abort();
    case 7: *(volatile int *)-8 = 1; break;
    case 8: __builtin_trap();
    case 9: ((void (*)(void))0x7000)();
    default: return;
    }
}

static void setup(void) {
    set_motors(70, 70);
    set_color(RGB(0, 3, 0));
}

static void loop(void) {
    static uint32_t last;
    if (kilo_ticks == last) return;
    last = kilo_ticks;
    if (last == 100) fail();
    if (last == 300) printf("lives on, %d %d", array[0], zero);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
