// expect: flash
#include <avr/pgmspace.h>
#include <kilolib.h>

static const uint8_t table[26000] PROGMEM = {1, 2, 3};
static volatile uint16_t at;

static void setup(void) {}
static void loop(void) { set_color(pgm_read_byte(&table[at++ % sizeof table])); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
