// Shows its battery's voltage.
#include <kilolib.h>

static void loop(void) {
    const int16_t voltage = get_voltage();
    if (voltage != -1)
        set_color(voltage > 700 ? RGB(0, 1, 0) : voltage > 600 ? RGB(1, 1, 0) : RGB(1, 0, 0));
    delay(250);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
