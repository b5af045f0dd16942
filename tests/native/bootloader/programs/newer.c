/// The program that comes by infrared light: its loop() turns the LED yellow. It is longer than
/// programs/older.c.
#include <avr/pgmspace.h>
#include <kilolib.h>

// Whatever is in flash has to arrive: the LED is yellow only if the sum is right.
static const uint8_t table[500] PROGMEM = {[0] = 1, [99] = 2, [299] = 3, [499] = 4};

static void setup(void) {}

static void loop(void) {
    uint8_t sum = 0;
    for (uint16_t i = 0; i < sizeof table; i++) sum = (uint8_t)(sum + pgm_read_byte(&table[i]));
    set_color(sum == 10 ? RGB(3, 3, 0) : RGB(0, 0, 3));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
