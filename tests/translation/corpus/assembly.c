// Counts by inline assembly.
#include <kilolib.h>

static uint8_t count;

static void setup(void) {}

static void loop(void) {
    uint8_t value = count;
    __asm__ volatile("inc %0\n\t nop\n\t swap %0\n\t swap %0" : "+r"(value));
    count = value;
    set_color(count & 63);
    delay(40);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
