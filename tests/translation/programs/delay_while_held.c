// Interrupts held back over delay(), longer than a tick: ticks and frames get lost.
#include <avr/interrupt.h>
#include <kilolib.h>

static message_t message;
static volatile uint8_t received;

static message_t *message_tx(void) { return &message; }

static void message_rx(message_t *received_one, distance_measurement_t *distance) { received++; }

static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
}

static void loop(void) {
    cli();
    set_color(RGB(received & 1, 0, 0));
    delay(40 + (rand_soft() & 31));
    sei();
    set_color(RGB(0, 1, 0));
    delay(30);
}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
