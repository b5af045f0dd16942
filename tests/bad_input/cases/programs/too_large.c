// A table that leaves no room for the boot loader.
#include <avr/pgmspace.h>
#include <kilolib.h>

static const uint8_t table[26000] PROGMEM = {1, 2, 3};

static void setup(void) {}

static void loop(void) { set_color(pgm_read_byte(&table[kilo_ticks])); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
