// Two producers for one message: the first in each pass, the second where an interrupt has found
// the first one's place free.
#include <kilolib.h>

static message_t message;
static volatile uint8_t is_filled;
static uint8_t has_second;

static message_t *message_tx(void) { return is_filled ? &message : 0; }
static void message_tx_success(void) { is_filled = 0; }

static void fill(uint8_t who) {
    if (is_filled) return;
    message.type = NORMAL;
    message.crc = message_crc(&message);
    if (who == 2) has_second = 1;
    is_filled = 1;
}

static void setup(void) {}

static void loop(void) {
    fill(1);
    for (volatile uint16_t wait = 0; wait < 2000; wait++) {
    }
    fill(2);
    set_color(has_second ? RGB(0, 1, 0) : RGB(1, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_tx_success = message_tx_success;
    kilo_start(setup, loop);
    return 0;
}
