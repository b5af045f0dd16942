// Works once a tick, by two reads of kilo_ticks between which a tick may come, and is asked for a
// message at each tick before it has one. Its LED shows at which cycle it changes.
#include <avr/io.h>
#include <kilolib.h>

static uint32_t last, next_change = 40, next_talk = 60;
static uint8_t changes;
static message_t message;

static message_t *message_tx(void) { return kilo_ticks >= next_talk ? &message : 0; }
static void message_tx_success(void) { next_talk = kilo_ticks + 40 + (kilo_uid & 7); }

static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
}

static void loop(void) {
    if (kilo_ticks == last) return;
    last = kilo_ticks;
    if (last < next_change) return;
    next_change = last + 5 + (rand_soft() & 15);
    changes++;
    const uint8_t cycle = TCNT1L;
    set_color(RGB(cycle & 3, cycle >> 2 & 3, cycle >> 4 & 3));
    set_motors(changes & 1 ? kilo_turn_left : 0, kilo_turn_right);
}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_tx_success = message_tx_success;
    kilo_start(setup, loop);
    return 0;
}
