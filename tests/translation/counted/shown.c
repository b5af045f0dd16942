// Shows by its LED what it counts, in every way but a comparison: by a product, a table, and what a
// function returns.
#include <kilolib.h>

static uint16_t passes;
static uint8_t turns;
static const uint8_t colors[4] = {3, 12, 48, 63};

static __attribute__((noinline)) uint16_t passed(void) { return ++passes; }

static void setup(void) {}

static void loop(void) {
    turns++;
    if (kilo_uid & 1)
        set_color(colors[turns >> 6]);
    else
        set_color((uint8_t)(passed() * 3 >> 12));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
