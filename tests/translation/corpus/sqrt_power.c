// A mean and its spread in floats, in each pass.
#include <kilolib.h>
#include <math.h>

static float mean, power;
static uint16_t passes;

static void loop(void) {
    const float value = passes & 31;
    mean += (value - mean) * 0.02f;
    power += (value * value - power) * 0.02f;
    if (++passes < 500) return;
    passes = 0;
    set_color((uint8_t)sqrt(fabs(power - mean * mean)) & 15);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
