// Prints in a loop that waits, so that the serial line sets its pace.
#include <kilolib.h>
#define DEBUG
#include <debug.h>

static uint32_t until;
static uint8_t color;

static void setup(void) { debug_init(); }

static void loop(void) {
    while (kilo_ticks < until) printf("%lu\n", (unsigned long)kilo_ticks);
    until = kilo_ticks + 20;
    set_color(++color & 7);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
