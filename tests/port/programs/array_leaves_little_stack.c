// expect: stack 4
#include <kilolib.h>

int seen[18][48] = {0};
static uint8_t cells;

static void setup(void) {}

static void loop(void) {
    if (seen[cells % 18][cells % 48] == 0) seen[cells % 18][cells % 48] = 1;
    cells++;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
