// Waits in setup(), then sends every 16 ticks; prints when it is asked for the first message.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static message_t out;
static volatile uint8_t heard;

static message_t *send(void) {
    static uint8_t asked;
    if (asked++ == 0) printf("asked at %lu", (unsigned long)kilo_ticks);
    return &out;
}

static void receive(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
    delay(5);
}

static void setup(void) {
    delay(300);
    spinup_motors();
    out.data[0] = heard;
    out.crc = message_crc(&out);
}

static void loop(void) { set_color(heard & RGB(3, 3, 3)); }

int main(void) {
    kilo_message_tx = send;
    kilo_message_rx = receive;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
