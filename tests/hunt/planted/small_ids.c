// An assumption that ids are small: a table that has a place for each of the first 32.
#include <kilolib.h>

static message_t out;
static uint8_t heard[32];
static uint8_t most;

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    const uint16_t id = in->data[0] | in->data[1] << 8;
    if (heard[id] < 255) heard[id]++;
    if (heard[id] > most) most = heard[id];
}

static void setup(void) {
    out.data[0] = kilo_uid;
    out.data[1] = kilo_uid >> 8;
    out.crc = message_crc(&out);
    set_color(RGB(0, 1, 0));
}

static void loop(void) { set_color(most > 10 ? RGB(0, 0, 1) : RGB(0, 1, 0)); }

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
