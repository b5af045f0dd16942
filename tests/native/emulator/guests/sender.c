// Sends how often it was asked and how often it succeeded. 0x30 sets the period, 0x31 silences it,
// 0x32 sets the clock.
#include <kilolib.h>
#include <stddef.h>

static message_t out;
static uint8_t asked, succeeded, silent;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    uint16_t value = (uint16_t)(message->data[0] | message->data[1] << 8);
    if (message->type == 0x30) kilo_tx_period = value;
    if (message->type == 0x31) silent = message->data[0];
    if (message->type == 0x32) kilo_ticks = value;
}

static message_t *send(void) {
    asked++;
    if (silent) return NULL;
    out.type = 5;
    out.data[0] = asked;
    out.data[1] = succeeded;
    for (int i = 0; i < 4; i++) out.data[2 + i] = (uint8_t)(kilo_ticks >> 8 * i);
    out.crc = message_crc(&out);
    return &out;
}

static void on_success(void) { succeeded++; }
static void nothing(void) {}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = send;
    kilo_message_tx_success = on_success;
    kilo_init();
    kilo_start(nothing, nothing);
    return 0;
}
