// expect: int-width 10
#include <kilolib.h>

static volatile uint32_t seen;
static volatile uint8_t id = 20;

static void setup(void) {}

static void loop(void) {
    seen |= 1 << id;
    if (seen > 65535) set_color(RGB(3, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
