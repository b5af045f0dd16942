// expect: ticks-lost warns
// Flashes, and wants nothing to disturb it.
#include <avr/interrupt.h>
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    cli();
    set_color(RGB(0, 0, 1));
    delay(150);
    set_color(RGB(0, 0, 0));
    sei();
    delay(500);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
