// expect: stack-meets-data fails 7
// A tree that gets deeper each time.
#include <kilolib.h>

static volatile uint8_t depth;

static uint8_t __attribute__((noinline)) visit(uint8_t level) {
    uint8_t path[16];
    for (uint8_t i = 0; i < sizeof path; i++) path[i] = (uint8_t)(level + i);
    if (level == 0) return 0;
    return (uint8_t)(visit((uint8_t)(level - 1)) + path[depth % sizeof path]);
}

static void setup(void) {}

static void loop(void) {
    delay(50);
    set_color(visit(depth++) & 3);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
