// Reads its tune from flash.
#include <avr/pgmspace.h>
#include <kilolib.h>

static const uint16_t tune[] PROGMEM = {120, 60, 240, 35, 480};
static const uint8_t colors[] PROGMEM = {1, 4, 16, 20, 63};
static uint8_t at;

static void setup(void) {}

static void loop(void) {
    set_color(pgm_read_byte(&colors[at]));
    delay(pgm_read_word(&tune[at]));
    at = (at + 1) % 5;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
