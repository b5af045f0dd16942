// Waits in its callbacks: by delay() in one, for a time in the other.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static message_t out;
static uint16_t heard, sent;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
    delay((uint16_t)(100 + 50 * kilo_uid));
}

static message_t *send(void) {
    for (volatile uint32_t i = 0; i < 30000; i++) {
    }
    return &out;
}

static void on_success(void) {
    sent++;
    delay(20);
}

static void setup(void) { out.crc = message_crc(&out); }

static void loop(void) {
    static uint32_t next;
    if (kilo_ticks < next) return;
    next = kilo_ticks + 100;
    printf("%u heard, %u sent", heard, sent);
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = send;
    kilo_message_tx_success = on_success;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
