// expect: differs fails
// Takes a number from flash as it is: without a sign on the robot, -20 is more than 40,000.
#include <avr/pgmspace.h>
#include <kilolib.h>

static const int gain[] PROGMEM = {10, -20};
static uint8_t at;

static void setup(void) {}

static void loop(void) {
    delay(500);
    set_color(pgm_read_word(&gain[at++ & 1]) > 40000 ? RGB(3, 0, 0) : RGB(0, 3, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
