// A race on an element of an array: each is two bytes, and loop() has them by a pointer.
#include <kilolib.h>

#define PLACES 8

static message_t out;
static uint16_t heard[PLACES];  // their halves are always alike

static message_t *tx(void) {
    out.data[0]++;
    out.data[1] = kilo_uid % PLACES;
    out.crc = message_crc(&out);
    return &out;
}

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    heard[in->data[1]] = (uint16_t)(in->data[0] << 8 | in->data[0]);
}

static void setup(void) { set_color(RGB(0, 1, 0)); }

static void loop(void) {
    for (uint8_t place = 0; place < PLACES; place++) {
        const uint16_t seen = heard[place];
        if ((uint8_t)(seen >> 8) != (uint8_t)seen) set_color(RGB(1, 0, 0));
    }
    delay(2);
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
