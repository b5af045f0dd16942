// Averages the readings that are good, and leaves out those while a message comes.
#include <kilolib.h>

static void loop(void) {
    uint16_t sum = 0, good = 0;
    while (good < 50) {
        const int16_t light = get_ambientlight();
        if (light == -1) continue;
        sum += light;
        good++;
    }
    set_color((sum / 50) >> 4 & 3);
    delay(100);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
