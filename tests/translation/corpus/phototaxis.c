// Turns to the side where the light is brighter, with a threshold.
#include <kilolib.h>

enum { LEFT, RIGHT };
static uint8_t side;
static int16_t before;

static void loop(void) {
    const int16_t now = get_ambientlight();
    if (now == -1) return;
    if (now < before - 30 || now > before + 30) {
        side = now > before ? side : !side;
        before = now;
        spinup_motors();
        if (side == LEFT)
            set_motors(kilo_turn_left, 0);
        else
            set_motors(0, kilo_turn_right);
        set_color(side == LEFT ? RGB(1, 0, 0) : RGB(0, 0, 1));
    }
    delay(200);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
