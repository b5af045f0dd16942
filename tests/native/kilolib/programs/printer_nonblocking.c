/// Says more than its queue holds by the serial line, without waiting for it.
#define DEBUG
#define NONBLOCKING
#include <debug.h>
#include <kilolib.h>

volatile uint8_t said;

static void setup(void) {
    for (uint8_t i = 0; i < 20; i++) printf("line %2u\n", i);
    said = 1;
}
static void loop(void) {}

int main(void) {
    kilo_init();
    debug_init();
    kilo_start(setup, loop);
    return 0;
}
