// Stays 100 ms in the callback for each message, 70 ms when asked for one (by then uid 2 only).
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    uint8_t first = message->data[0];
    delay(100);
    printf("heard %u, still %u, at %lu", first, message->data[0], (unsigned long)kilo_ticks);
}

static message_t *no_message(void) {
    if (kilo_uid == 2) {
        delay(70);
        printf("asked at %lu", (unsigned long)kilo_ticks);
    }
    return NULL;
}

static void setup(void) {}

static void loop(void) {
    static uint32_t last;
    if (kilo_ticks != last) printf("tick %lu", (unsigned long)kilo_ticks);
    last = kilo_ticks;
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = no_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
