// Walks, turns where it hears others, and never names kilo_message_tx.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static volatile uint8_t heard;
static uint32_t next_tick;

static void on_message(message_t *message, distance_measurement_t *distance) {
    heard = (uint8_t)(heard + message->data[0] + distance->high_gain);
}

static void setup(void) { rand_seed(rand_hard()); }

static void loop(void) {
    static uint8_t seen;
    if (seen == heard && kilo_ticks < next_tick) return;
    next_tick = kilo_ticks + 10 + rand_soft();
    if (seen != heard)
        set_motors(kilo_turn_left, 0);
    else
        set_motors(kilo_straight_left, kilo_straight_right);
    seen = heard;
    set_color(seen & 0x3F);
    if (seen % 16 == 0) printf("heard %u", seen);
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
