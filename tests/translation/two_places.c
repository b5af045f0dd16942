// Counts while it waits, in a loop that calls a function from two places: which of the calls a pass
// of the loop in it belongs to, only the stack knows.
#include <kilolib.h>

static volatile uint8_t flag;
static uint32_t begun;

static void __attribute__((noinline)) look(void) {
    for (uint16_t i = 256; i > 0; i--) (void)flag;
}

static void setup(void) { begun = kilo_ticks; }

static void loop(void) {
    uint16_t rounds = 0;
    while (kilo_ticks - begun < TICKS_PER_SEC) {
        look();
        look();
        rounds++;
    }
    begun = kilo_ticks;
    set_color(rounds > 1000 ? RGB(0, 3, 0) : RGB(3, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
