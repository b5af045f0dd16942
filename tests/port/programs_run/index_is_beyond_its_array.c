// expect: array-bounds warns 11
// A table by uid, for fewer robots than there are.
#include <kilolib.h>

static volatile uint8_t seen[4];
static volatile uint8_t rest[16];

static void setup(void) {}

static void loop(void) {
    seen[kilo_uid]++;
    rest[3]++;
    delay(1000);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
