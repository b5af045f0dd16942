/// Walks, and talks with a period of its own, 250 to 515 ms, that it sets once.
#include "talker.h"
#include "walker.h"

static void setup(void) {
    begin_to_walk();
    kilo_tx_period = (uint16_t)(1953 + 8 * between(0, 255));
}

int main(void) {
    prepare_to_talk(say_here);
    kilo_start(setup, walk);
    return 0;
}
