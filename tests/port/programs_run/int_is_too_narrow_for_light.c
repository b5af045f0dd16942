// expect: differs fails
// It also reads the light at another time: that alone does not excuse a difference.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static void setup(void) { debug_init(); }

static void loop(void) {
    int16_t light = get_ambientlight();
    if (light == -1) return;
    printf("%d\n", light);
    set_color(light * 80 > 20000 ? RGB(1, 0, 0) : RGB(0, 1, 0));
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
