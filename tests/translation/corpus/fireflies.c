// Flashes once a period, and comes nearer to those that it hears flash.
#include <kilolib.h>

static message_t message;
static volatile uint8_t heard;
static uint32_t next;
static uint8_t is_lit;

static message_t *message_tx(void) { return is_lit ? &message : 0; }

static void message_rx(message_t *received, distance_measurement_t *distance) {
    (void)received;
    (void)distance;
    heard++;
}

static void loop(void) {
    if (heard) {
        heard = 0;
        if (next > kilo_ticks + 20) next -= (next - kilo_ticks) / 4;
    }
    if (kilo_ticks >= next) {
        is_lit = 1;
        set_color(RGB(1, 1, 1));
        next = kilo_ticks + 60;
    } else if (is_lit && kilo_ticks + 52 > next) {
        is_lit = 0;
        set_color(0);
    }
}

static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
    next = kilo_ticks + 60;
}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
