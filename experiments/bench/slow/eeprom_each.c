/// Reads two bytes of the EEPROM in each pass.
#include <avr/eeprom.h>
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    const uint8_t first = eeprom_read_byte((uint8_t *)0x10);
    const uint8_t second = eeprom_read_byte((uint8_t *)0x11);
    set_color(RGB(first & 1, second & 1, 1));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
