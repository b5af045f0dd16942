// A beat by a modulo of the clock: a pass of loop() that takes longer than a tick skips it.
#include <kilolib.h>

static message_t out;
static volatile uint8_t has_message;
static uint32_t last_beat;

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)in;
    (void)d;
    has_message = 1;
}

static void setup(void) {
    out.crc = message_crc(&out);
    last_beat = kilo_ticks;
    set_color(RGB(0, 1, 0));
}

static void loop(void) {
    if (kilo_ticks % 32 == 0) last_beat = kilo_ticks;
    if (kilo_ticks - last_beat > 40) set_color(RGB(1, 0, 0));
    if (has_message) {
        has_message = 0;
        delay(50);
    }
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
