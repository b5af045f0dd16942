// Prints its first random bytes, then is quiet.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static void setup(void) {
    uint8_t draws[4];
    for (int i = 0; i < 4; i++) draws[i] = rand_hard();
    printf("%u %u %u %u", draws[0], draws[1], draws[2], draws[3]);
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
