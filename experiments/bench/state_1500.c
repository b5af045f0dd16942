/// Walks and talks, with 1,500 bytes of state of its own: a table of what was heard from whom.
#include "talker.h"
#include "walker.h"

static struct {
    uint16_t uid, frames;
    uint8_t distance_mm, colour;
} seen[250];

static void note_sender(message_t *received, distance_measurement_t *distance) {
    const uint16_t uid = (uint16_t)(received->data[0] | received->data[1] << 8);
    const uint8_t place = (uint8_t)(uid % (sizeof seen / sizeof seen[0]));
    seen[place].uid = uid;
    seen[place].frames++;
    seen[place].distance_mm = estimate_distance(distance);
}

static void setup(void) {
    kilo_message_rx = note_sender;
    begin_to_walk();
}

int main(void) {
    prepare_to_talk(say_here);
    kilo_start(setup, walk);
    return 0;
}
