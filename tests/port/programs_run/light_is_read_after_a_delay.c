// expect: differs-in-time warns
#include <kilolib.h>

static int16_t before;
static uint8_t turns_left;

static void setup(void) { before = get_ambientlight(); }

static void loop(void) {
    int16_t light = get_ambientlight();
    if (light != -1) {
        if (light < before) turns_left = !turns_left;
        before = light;
    }
    spinup_motors();
    if (turns_left)
        set_motors(kilo_turn_left, 0);
    else
        set_motors(0, kilo_turn_right);
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
