// expect: float-to-int warns 11
// A heading in degrees as a byte, and a negative one as a number without a sign.
#include <kilolib.h>

static volatile float heading = 170;
static volatile uint8_t shown;

static void setup(void) {}

static void loop(void) {
    shown = (uint8_t)heading;
    heading += 45;
    delay(250);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
