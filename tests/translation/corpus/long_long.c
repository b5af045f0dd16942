// Numbers of 64 bits: a product, a quotient and a shift each pass.
#include <kilolib.h>

static uint64_t state = 88172645463325252ull;
static uint16_t passes;

static void loop(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    if (++passes % 64) return;
    set_color((uint8_t)(state / 1000003u) & 63);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
