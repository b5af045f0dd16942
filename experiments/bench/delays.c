/// Walks and talks; each loop() has a delay of 20 ms.
#include "talker.h"
#include "walker.h"

static void loop(void) {
    delay(20);
    walk();
}

int main(void) {
    prepare_to_talk(say_here);
    kilo_start(begin_to_walk, loop);
    return 0;
}
