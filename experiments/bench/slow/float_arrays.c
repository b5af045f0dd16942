/// Goes through arrays of floats in each pass.
#include <kilolib.h>

#define COUNT 16

static float place[COUNT], speed[COUNT];
static uint32_t last;

static void setup(void) {
    for (uint8_t i = 0; i < COUNT; i++) {
        place[i] = i;
        speed[i] = 0.01f * (float)(i + kilo_uid);
    }
}

static void loop(void) {
    float sum = 0;
    for (uint8_t i = 0; i < COUNT; i++) {
        place[i] += speed[i] * 0.03f;
        if (place[i] > 100) place[i] -= 100;
        sum += place[i];
    }
    if (kilo_ticks <= last + 31) return;
    last = kilo_ticks;
    set_color(sum > 800 ? RGB(1, 0, 0) : RGB(0, 0, 1));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
