// A race on two bytes: loop() reads a number while a message writes its other half.
#include <kilolib.h>

static message_t out;
static volatile uint16_t latest;  // its halves are always alike
static uint8_t counter;

static message_t *tx(void) {
    counter++;
    out.data[0] = counter;
    out.crc = message_crc(&out);
    return &out;
}

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    latest = (uint16_t)(in->data[0] << 8 | in->data[0]);
}

static void setup(void) { set_color(RGB(0, 1, 0)); }

static void loop(void) {
    const uint16_t seen = latest;
    if ((uint8_t)(seen >> 8) != (uint8_t)seen) set_color(RGB(1, 0, 0));
    delay(1);
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
