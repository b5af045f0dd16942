// expect: differs fails
// Seconds times a thousand, in an int.
#include <kilolib.h>

static volatile int seconds;

static void setup(void) {}

static void loop(void) {
    delay(1000);
    seconds++;
    set_color((uint8_t)(seconds * 7000 / 3000));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
