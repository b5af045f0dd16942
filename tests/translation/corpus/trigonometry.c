// Steers by sine and square root at each tick.
#include <kilolib.h>
#include <math.h>

static uint32_t last;

static void setup(void) {}

static void loop(void) {
    if (kilo_ticks == last) return;
    last = kilo_ticks;
    const float angle = (uint16_t)last * 0.05f;
    const float size = sqrtf(fabsf(sinf(angle)));
    set_motors((uint8_t)(size * 100), (uint8_t)((1 - size) * 100));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
