/// Walks and talks; each loop() has a loop of 200 turns, whose result is kept.
#include "talker.h"
#include "walker.h"

static volatile uint16_t noise;  // or the compiler would leave the loop out

static void loop(void) {
    uint16_t mixed = (uint16_t)kilo_ticks;
    for (uint8_t turn = 0; turn < 200; turn++) mixed = (uint16_t)(mixed * 25173u + 13849u);
    noise = mixed;
    walk();
}

int main(void) {
    prepare_to_talk(say_here);
    kilo_start(begin_to_walk, loop);
    return 0;
}
