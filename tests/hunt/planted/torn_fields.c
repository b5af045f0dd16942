// A race on two fields: loop() reads an id, and then the check of the next message's.
#include <kilolib.h>

#define CHECK 0x5A

static message_t out;
static struct { uint8_t id, check; } last = {0, CHECK};

static message_t *tx(void) {
    out.data[0]++;
    out.crc = message_crc(&out);
    return &out;
}

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    last.id = in->data[0];
    last.check = in->data[0] ^ CHECK;
}

static void setup(void) { set_color(RGB(0, 1, 0)); }

static void loop(void) {
    const uint8_t id = last.id, check = last.check;
    if ((id ^ CHECK) != check) set_color(RGB(1, 0, 0));
    delay(20);
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
