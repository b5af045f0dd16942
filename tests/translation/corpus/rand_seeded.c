// Walks by rand(), seeded by noise.
#include <kilolib.h>
#include <stdlib.h>

static void loop(void) {
    const int draw = rand() % 3;
    set_color(1 << 2 * draw);
    spinup_motors();
    set_motors(draw != 1 ? kilo_turn_left : 0, draw != 2 ? kilo_turn_right : 0);
    delay(300 + rand() % 500);
}

static void setup(void) { srand(rand_hard()); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
