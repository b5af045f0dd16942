// expect: few-bits 13
#include <kilolib.h>

static volatile float noise = 0.001;
static float drawn;

static void draw(void) { drawn = rand_soft() / 256.0; }

static void setup(void) {}

static void loop(void) {
    draw();
    if (noise > drawn) set_color(RGB(0, 1, 0));
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
