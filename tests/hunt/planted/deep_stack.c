// A stack that meets the data: a recursion as deep as the hops from a robot that may be gone.
#include <kilolib.h>

static message_t out;
static volatile uint8_t hops = 255;
static volatile uint8_t nearest = 255;
static uint32_t looks_at;
static volatile uint8_t sum;

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    if (in->data[0] < nearest) nearest = in->data[0];
}

static uint8_t __attribute__((noinline)) weigh(uint8_t hop) {
    volatile uint8_t path[48];
    path[hop % 48] = hop;
    sum += path[hop % 48];
    return hop == 0 ? sum : weigh(hop - 1) + path[hop % 48];
}

static void setup(void) {
    if (kilo_uid == 1) hops = 0;
    out.data[0] = hops;
    out.crc = message_crc(&out);
    looks_at = kilo_ticks + 16;
}

static void loop(void) {
    if (kilo_ticks < looks_at) return;
    looks_at = kilo_ticks + 16;
    if (kilo_uid != 1 && nearest < 255) hops = nearest + 1;
    nearest = 255;
    message_t next = out;
    next.data[0] = hops;
    next.crc = message_crc(&next);
    out = next;
    if (hops < 200) weigh(hops);
    set_color(hops == 0 ? RGB(1, 1, 1) : RGB(0, hops % 4, 1));
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
