// A division by the number of neighbours, which may be zero.
#include <kilolib.h>

static message_t out;
static volatile uint16_t sum_mm, neighbours;
static uint32_t looks_at;

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)in;
    sum_mm += estimate_distance(d);
    neighbours++;
}

static void setup(void) {
    out.crc = message_crc(&out);
    looks_at = kilo_ticks + 128;
}

static void loop(void) {
    if (kilo_ticks < looks_at) return;
    looks_at = kilo_ticks + 128;
    set_color(sum_mm / neighbours < 60 ? RGB(0, 1, 0) : RGB(0, 0, 1));
    sum_mm = neighbours = 0;
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
