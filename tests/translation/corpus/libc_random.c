// Draws by avr-libc, seeded by the robot's noise.
#include <kilolib.h>
#include <stdlib.h>

static void setup(void) { srand(rand_hard()); }

static void loop(void) {
    const int draw = rand();
    set_color(draw & 63);
    set_motors(draw >> 4 & 127, draw >> 8 & 127);
    delay(20 + draw % 200);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
