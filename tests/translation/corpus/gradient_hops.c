// One more than the least that was heard, which is forgotten after a while.
#include <kilolib.h>

static message_t message;
static volatile uint8_t is_new, heard;
static uint8_t own = 255;
static uint32_t last;

static message_t *message_tx(void) { return &message; }

static void message_rx(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    heard = received->data[0];
    is_new = 1;
}

static void loop(void) {
    if (is_new) {
        is_new = 0;
        if (heard < own) {
            own = heard + 1;
            last = kilo_ticks;
        }
    }
    if (kilo_ticks > last + 64) own = 255;
    if (message.data[0] != own) {
        message.data[0] = own;
        message.crc = message_crc(&message);
    }
    set_color(own == 255 ? 0 : 1 << (own % 6));
}

static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
