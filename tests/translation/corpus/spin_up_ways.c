// Starts its motors in turns, by the constant and by hand.
#include <kilolib.h>

static uint8_t turn;

static void loop(void) {
    if (turn & 1) {
        spinup_motors();
    } else {
        set_motors(255, 255);
        delay(15);
    }
    set_motors(kilo_straight_left >> (turn & 2), kilo_straight_right);
    delay(500);
    set_motors(0, 0);
    delay(250);
    turn++;
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
