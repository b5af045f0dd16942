// Shifts an int beyond its 16 bits, and compares what is left.
#include <kilolib.h>

static volatile uint8_t places;

static void setup(void) {}

static void loop(void) {
    const int mask = 1 << (places & 15);
    const long far = (long)mask << 4;
    set_color(mask < 0 ? RGB(1, 0, 0) : far > 4096 ? RGB(0, 1, 0) : RGB(0, 0, 1));
    places++;
    delay(61);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
