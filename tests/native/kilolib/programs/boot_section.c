/// Something at the beginning of the boot section that turns the LED red.
#include <avr/io.h>
#include <kilolib.h>

__attribute__((section(".boot"), used, naked)) void boot(void) {
    DDRC = 0;
    DDRD = 1 << PD4 | 1 << PD5;
    for (;;) {
    }
}

static void setup(void) {}
static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
