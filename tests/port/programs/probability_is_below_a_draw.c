// expect: few-bits 9
#include <kilolib.h>

#define P_LEAVE 0.001f

static void setup(void) {}

static void loop(void) {
    if ((float)rand_soft() / 255.0f < P_LEAVE) set_color(RGB(0, 1, 0));
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
