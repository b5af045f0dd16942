// A message that goes out while loop() fills it in: its check is right, its halves are not alike.
#include <kilolib.h>

static message_t out;
static uint8_t steps;

static message_t *tx(void) {
    out.crc = message_crc(&out);
    return &out;
}

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    if ((uint8_t)~in->data[0] != in->data[1]) set_color(RGB(1, 0, 0));
}

static void setup(void) {
    out.data[1] = 0xFF;
    set_color(RGB(0, 1, 0));
}

static void loop(void) {
    steps++;
    out.data[0] = steps;
    out.data[1] = (uint8_t)~steps;
    delay(10);
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
