// Flags in bit fields, set by callbacks and by loop().
#include <kilolib.h>

static volatile struct {
    unsigned heard : 1;
    unsigned odd : 1;
    unsigned count : 5;
} flags;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    flags.heard = 1;
    flags.odd = message->data[1] & 1;
}

static void loop(void) {
    if (flags.heard) {
        flags.heard = 0;
        flags.count++;
    }
    set_color((flags.odd ? 32 : 0) | flags.count);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
