// Messages in a queue, which callbacks fill and loop() empties slowly.
#include <kilolib.h>
#include <util/atomic.h>

static volatile uint8_t queue[8], first, count;

static void message_rx(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    if (count == 8) return;
    queue[(first + count) & 7] = message->data[0];
    count++;
}

static void loop(void) {
    if (count == 0) return;
    const uint8_t value = queue[first];
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        first = (first + 1) & 7;
        count--;
    }
    set_color(value & 63);
    delay(60);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
