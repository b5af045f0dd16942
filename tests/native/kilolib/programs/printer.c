/// Says a line by the serial line in setup().
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static void setup(void) { printf("uid %u, %d ticks a second\n", kilo_uid, TICKS_PER_SEC); }
static void loop(void) {}

int main(void) {
    kilo_init();
    debug_init();
    kilo_start(setup, loop);
    return 0;
}
