// Sets a count in each pass of some ticks before it adds to it, and counts on in the others; holds
// interrupts back meanwhile.
#include <avr/interrupt.h>
#include <kilolib.h>

static volatile uint8_t begun = 7;
static volatile uint16_t held;

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks & 8) begun = 7;
    if (++begun == 8) set_color(2);
    if (begun == 99) set_color(3);
    cli();
    held++;
    sei();
    if (held == 50001) set_motors(90, 70);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
