// Reads the thermometer now and then.
#include <kilolib.h>

static uint8_t reads;

static void loop(void) {
    const int16_t reading = get_temperature();
    reads += reading > 200 && reading < 400;
    set_color(reads & 63);
    delay(400);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
