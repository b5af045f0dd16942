/// Goes to and fro between two states, with a colour each.
#include <kilolib.h>

static enum { SEARCHES, HAS_FOUND } state;

static void setup(void) {}

static void loop(void) {
    switch (state) {
    case SEARCHES:
        set_color(RGB(1, 0, 0));
        if (kilo_ticks & 1) state = HAS_FOUND;
        break;
    case HAS_FOUND:
        set_color(RGB(0, 1, 0));
        state = SEARCHES;
        break;
    }
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
