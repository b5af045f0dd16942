// A state machine by the clock, as most programs have one.
#include <kilolib.h>

enum { WAIT, GO, TURN };
static uint8_t state;
static uint32_t since;

static void setup(void) { since = kilo_ticks; }

static void loop(void) {
    const uint16_t age = (uint16_t)(kilo_ticks - since);
    switch (state) {
    case WAIT:
        if (age < 30) return;
        set_motors(kilo_straight_left, kilo_straight_right);
        set_color(RGB(0, 1, 0));
        break;
    case GO:
        if (age < 50) return;
        set_motors(kilo_turn_left, 0);
        set_color(RGB(1, 1, 0));
        break;
    default:
        if (age < 20) return;
        set_motors(0, 0);
        set_color(RGB(1, 0, 0));
    }
    state = state == TURN ? WAIT : state + 1;
    since = kilo_ticks;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
