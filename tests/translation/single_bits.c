// Lights its LED by single bits of the ports' directions, with instructions for a bit (sbi, cbi),
// and touches no other pin in between.
#include <avr/io.h>
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    switch (kilo_ticks % 64) {
    case 10: DDRC |= 1 << 3; break;
    case 20: DDRD |= 1 << 5; break;
    case 30: DDRC &= ~(1 << 3); break;
    case 50: DDRD &= ~(1 << 5); break;
    default: break;
    }
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
