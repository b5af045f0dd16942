// Prints for 0.3 s before loop() begins, here as on the robot.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static void setup(void) {
    debug_init();
    set_color(RGB(3, 0, 0));
    for (uint8_t i = 0; i < 40; i++) printf("calibration value %d of forty\n", i);
}

static void loop(void) {
    set_color(RGB(0, 3, 0));
    delay(500);
    set_color(RGB(0, 0, 3));
    delay(500);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
