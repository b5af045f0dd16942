// expect: int-overflow warns 17
// A member of a structure behind a pointer, as programs for Kilombo have it, and a product.
#include <kilolib.h>

typedef struct {
    int16_t way, turns;
    uint8_t steps;
} state_t;

static state_t state, *me = &state;
static volatile uint8_t per_step = 200;

static void setup(void) {}

static void loop(void) {
    me->steps++;
    me->way = (int16_t)(per_step * me->steps * 30);
    if (me->way == 1) set_color(RGB(1, 0, 0));
    delay(250);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
