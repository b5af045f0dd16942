// expect: stack
#include <kilolib.h>

static uint16_t history[980];
static uint16_t n;

static void setup(void) {}
static void loop(void) { history[n++ % 980] = rand_soft() + history[n % 7]; }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
