// A message that is rewritten while it is on air: one half of it is old, and no robot takes it.
#include <kilolib.h>

static message_t out;
static volatile uint32_t last_heard;

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)in;
    (void)d;
    last_heard = kilo_ticks;
}

static void setup(void) {
    out.crc = message_crc(&out);
    last_heard = kilo_ticks;
    set_color(RGB(0, 1, 0));
}

static void loop(void) {
    const uint8_t light = get_ambientlight() >> 3;
    if (light != out.data[0]) {
        out.data[0] = light;
        out.crc = message_crc(&out);
    }
    if (kilo_ticks - last_heard > 90) set_color(RGB(1, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
