// Counts its loops in the EEPROM, which takes its time.
#include <avr/eeprom.h>
#include <kilolib.h>

// simavr has no time that a write takes: here nothing waits for it.
static void setup(void) {
    eeprom_write_byte((uint8_t *)0x200, 0);
    delay(10);
}

static void loop(void) {
    const uint8_t count = eeprom_read_byte((uint8_t *)0x200) + 1;
    eeprom_write_byte((uint8_t *)0x200, count);
    set_color(count & 63);
    delay(150);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
