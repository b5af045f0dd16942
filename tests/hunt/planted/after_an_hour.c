// An overflow after an hour: a deadline in an int, which has 16 bits on the robot.
#include <kilolib.h>

static int next_blink;
static uint8_t is_green;

static void setup(void) { next_blink = kilo_ticks + 16; }

static void loop(void) {
    if (kilo_ticks < next_blink) return;
    next_blink = kilo_ticks + 16;
    is_green = !is_green;
    set_color(is_green ? RGB(0, 1, 0) : RGB(0, 0, 1));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
