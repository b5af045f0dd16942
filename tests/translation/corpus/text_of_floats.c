// Prints floats, which takes the serial line's time.
#include <stdio.h>
#include <stdlib.h>
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static float value = 1.5f;
static uint8_t color;

static void loop(void) {
    value = value * 1.1f - 0.05f;
    if (value > 100) value = 1.5f;
    char text[16];
    dtostrf(value, 8, 3, text);
    printf("%s\n", text);
    set_color(++color & 63);
}

static void setup(void) { debug_init(); }

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
