/// Walks and talks; each loop() waits for eight ticks, by looking at the clock.
#include "talker.h"
#include "walker.h"

static void loop(void) {
    const uint32_t until = kilo_ticks + 8;
    while (kilo_ticks < until) continue;
    walk();
}

int main(void) {
    prepare_to_talk(say_here);
    kilo_start(begin_to_walk, loop);
    return 0;
}
