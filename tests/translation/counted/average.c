// Adds what it has heard to a sum in each pass and shows the average now and then.
#include <kilolib.h>

static uint32_t sum;
static uint16_t count;
static uint32_t next = 16;
static volatile uint8_t heard;
static message_t message;

static message_t *message_tx(void) {
    message.data[0] = (uint8_t)count;
    message.crc = message_crc(&message);
    return &message;
}
static void message_rx(message_t *m, distance_measurement_t *d) {
    (void)d;
    heard = m->data[0];
}

static void setup(void) { message.type = NORMAL; }

static void loop(void) {
    sum += heard;
    count++;
    if (kilo_ticks < next) return;
    next = kilo_ticks + 16;
    set_color(sum / count & 63);
    sum = count = 0;
}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
