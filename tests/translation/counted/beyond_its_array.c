// Counts passes, and reads an array farther than it goes, so that it sees the count.
#include <kilolib.h>

static uint8_t colors[4] = {1, 2, 3, 4};
static uint16_t passes;
static volatile uint8_t from;

static void setup(void) {}

static void loop(void) {
    const uint8_t *const farther = colors + from;
    uint8_t seen = 0;
    for (uint8_t i = 0; i < 40; i++) seen |= farther[i] & 0x40;
    set_color(seen >> 2);
    passes++;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
