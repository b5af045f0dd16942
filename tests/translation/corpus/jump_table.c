// Steps through a table of functions, and a switch that the compiler makes a table of.
#include <kilolib.h>

static uint8_t step;
static void red(void) { set_color(RGB(1, 0, 0)); }
static void green(void) { set_color(RGB(0, 1, 0)); }
static void blue(void) { set_color(RGB(0, 0, 1)); }
static void (*const actions[])(void) = {red, green, blue, green};
static uint8_t length(uint8_t of) {
    switch (of) {
    case 0: return 40;
    case 1: return 90;
    case 2: return 10;
    case 3: return 70;
    case 4: return 25;
    case 5: return 55;
    case 6: return 33;
    default: return 80;
    }
}

static void setup(void) {}

static void loop(void) {
    actions[step & 3]();
    delay(length(step & 7));
    step++;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
