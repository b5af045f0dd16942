#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    set_color(RGB(0, 1, 0));
    delay(500);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
