// A lost wake-up: the flag is cleared after the work, so that what came meanwhile is forgotten.
#include <kilolib.h>

static message_t out;
static volatile uint8_t has_order;
static volatile uint8_t order;

static message_t *tx(void) {
    if (kilo_uid != 1) return 0;
    const uint32_t tick = kilo_ticks;
    if (tick < 300)
        out.data[0] = 1;
    else if (tick < 600)
        out.data[0] = 2;
    else
        return 0;
    out.crc = message_crc(&out);
    return &out;
}

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    if (in->data[0] == order) return;
    order = in->data[0];
    has_order = 1;
}

static void setup(void) { set_color(kilo_uid == 1 ? RGB(1, 1, 1) : RGB(0, 0, 0)); }

static void loop(void) {
    if (!has_order) return;
    const uint8_t which = order;
    for (uint8_t blink = 0; blink < 10; blink++) {
        set_color(RGB(0, 0, 1));
        delay(100);
        set_color(RGB(0, 0, 0));
        delay(100);
    }
    set_color(which == 1 ? RGB(1, 1, 0) : RGB(0, 1, 0));
    has_order = 0;
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
