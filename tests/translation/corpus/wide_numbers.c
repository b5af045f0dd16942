// Divides and multiplies 32 and 64 bits in each pass.
#include <kilolib.h>

static uint32_t a = 12345;
static uint64_t b = 987654321;

static void setup(void) {}

static void loop(void) {
    a = a * 1664525u + 1013904223u;
    b += a % 1000u * (a / 77u);
    set_color((b >> 40) & 63);
    delay(25);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
