// Brings an EEPROM section along, and drives the IR LEDs that it names, one pin and then the other.
#include <avr/eeprom.h>
#include <avr/io.h>

// 0x05: a duty; 0x90: the pins of the IR LEDs.
EEMEM const uint8_t content[0x91] = {[0 ... 4] = 0xFF,       99, [6 ... 8] = 0xFF, 72,
                                     [0x0A ... 0x8F] = 0xFF, 3};

int main(void) {
    DDRB = 3;
    for (uint8_t pin = 0; pin < 2; pin++) {
        PORTB = 1 << pin;
        PORTB = 0;
    }
    for (;;) {
    }
}
