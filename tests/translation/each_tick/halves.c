// Notes the tick it has worked for in two variables of other widths, one of them some ticks ahead,
// and tells by its LED how many it has heard since, and at which cycle it looks.
#include <avr/io.h>
#include <kilolib.h>

static uint16_t seen;
static uint8_t soon;
static uint16_t from = 30;
static volatile uint8_t heard, talks;
static message_t message;

static message_t *message_tx(void) { return talks ? &message : 0; }
static void message_rx(message_t *m, distance_measurement_t *d) {
    (void)m, (void)d;
    heard++;
}

static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
    seen = (uint16_t)(kilo_ticks - 1);
}

static void loop(void) {
    const uint16_t now = (uint16_t)kilo_ticks;
    if (now == seen) return;
    if ((uint16_t)(now - seen) > 3) set_color(RGB(3, 0, 0));
    seen = now;
    soon = (uint8_t)(kilo_ticks + 9);
    if ((int16_t)(now - from) < 0) return;
    from = (uint16_t)(now + soon % 8 + 20);
    talks = (kilo_uid + (from >> 3)) % 3 == 0;
    const uint8_t cycle = TCNT1L;
    set_color(RGB((cycle ^ heard) & 3, cycle >> 2 & 3, cycle >> 4 & 3));
}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
