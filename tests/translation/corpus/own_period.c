// Sends more often than kilolib would, and counts what went out.
#include <kilolib.h>

static message_t message;
static volatile uint8_t sent;
static message_t *message_tx(void) { return &message; }
static void message_tx_success(void) { sent++; }

static void setup(void) {
    kilo_tx_period = 900;
    message.type = NORMAL;
    message.crc = message_crc(&message);
}

static void loop(void) { set_color(sent & 63); }

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_tx_success = message_tx_success;
    kilo_start(setup, loop);
    return 0;
}
