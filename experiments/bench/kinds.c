/// Walks and talks as one kind of several: KIND, a number, makes it a program of its own.
#include "talker.h"
#include "walker.h"

static void setup(void) {
    message.type = KIND;
    message.crc = message_crc(&message);
    begin_to_walk();
}

int main(void) {
    prepare_to_talk(say_here);
    kilo_start(setup, walk);
    return 0;
}
