// Holds interrupts back for part of each pass, less than an edge of light waits for.
#include <avr/interrupt.h>
#include <kilolib.h>

static uint16_t passes;

static void loop(void) {
    cli();
    for (volatile uint16_t i = 0; i < 8; i++) {
    }
    sei();
    if (++passes < 9000) return;
    passes = 0;
    set_color(kilo_ticks / 8 & 63);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
