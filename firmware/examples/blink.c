/// Blinks: the smallest program that uses the clock.
///
/// LED: red for half a second, off for half a second, and so on.
#include <kilolib.h>
#include <stdbool.h>

#define HALF_SECOND 15  // a tick is 32.768 ms

static uint32_t changed_at;
static bool lit;

// An interrupt counts the four bytes of kilo_ticks up, perhaps between our reads of them: read
// until two readings agree.
static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

// Runs once, at the first RUN.
static void setup(void) { changed_at = ticks_now(); }

// Runs again and again, thousands of times in a tick. It asks the clock what is due and returns,
// for a program that waits in here cannot do anything else meanwhile.
static void loop(void) {
    // A difference is right even when kilo_ticks wraps; `now >= changed_at + HALF_SECOND` is not.
    if (ticks_now() - changed_at < HALF_SECOND) return;
    changed_at += HALF_SECOND;  // not ticks_now(), or the blinking would slip

    lit = !lit;
    set_color(lit ? RGB(3, 0, 0) : RGB(0, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
