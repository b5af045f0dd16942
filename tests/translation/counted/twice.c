// Counts twice in a pass, and down and up again.
#include <kilolib.h>

static volatile uint16_t twice, there_and_back;

static void setup(void) {}

static void loop(void) {
    twice += 2;
    if (twice < 30000) twice -= 1;
    there_and_back -= 500;
    set_color(there_and_back & 0x4000 ? 1 : 2);
    there_and_back += 501;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
