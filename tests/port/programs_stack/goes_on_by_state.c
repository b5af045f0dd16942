// States are functions, called by address, that print; cases of a switch have own frames.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

typedef void (*state_t)(void);

static state_t state;
static volatile uint8_t sink;

static void __attribute__((noinline)) shuffle(uint8_t from) {
    volatile uint8_t order[90];
    for (uint8_t i = 0; i < sizeof order; i++) order[i] = (uint8_t)(from + i);
    sink = order[from % sizeof order];
}

static void rest(void);

static void walk(void) {
    printf("walk %d\n", sink);
    state = rest;
}

static void rest(void) {
    switch (sink & 7) {
    case 0: set_color(RGB(1, 0, 0)); break;
    case 1: set_color(RGB(0, 1, 0)); break;
    case 2: shuffle(sink); break;
    case 3: set_color(RGB(0, 0, 1)); return;
    case 4: set_color(RGB(1, 1, 0)); break;
    case 5: set_color(RGB(0, 1, 1)); break;
    default: sink++; return;
    }
    sink++;
    state = walk;
}

static void setup(void) {
    debug_init();
    state = walk;
}

static void loop(void) {
    state();
    delay(10);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
