/// Blinks by delay() with interrupts held back.
#include <avr/interrupt.h>
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    cli();
    set_color(RGB(1, 0, 0));
    delay(500);
    set_color(RGB(0, 0, 0));
    delay(500);
    sei();
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
