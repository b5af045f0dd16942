// A table that is full: a search for a place in it never comes back.
#include <kilolib.h>

#define PLACES 2

static message_t out;
static uint16_t known[PLACES];

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    const uint16_t id = in->data[0] | in->data[1] << 8;
    uint8_t place = id % PLACES;
    while (known[place] != 0 && known[place] != id) place = (place + 1) % PLACES;
    known[place] = id;
}

static void setup(void) {
    out.data[0] = kilo_uid;
    out.data[1] = kilo_uid >> 8;
    out.crc = message_crc(&out);
    known[kilo_uid % PLACES] = kilo_uid;
    set_color(RGB(0, 1, 0));
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
