// Variables that each pass takes to something else and back: a lock around a message that is filled
// again, a nearest neighbour that is looked for again, and a sum. Whether it is asked within the
// lock depends on some cycles, so that a chip shows another colour (docs/limits.md).
#include <kilolib.h>

#define NEIGHBOURS 6

static message_t said;
static volatile uint8_t locked, left_out;
static uint8_t distance_mm[NEIGHBOURS], last_heard[NEIGHBOURS];
static uint8_t nearest, nearest_mm;
static uint16_t sum_mm;

static message_t *say(void) {
    if (locked) left_out++;
    return locked ? 0 : &said;
}

static void hear(message_t *message, distance_measurement_t *measured) {
    const uint8_t from = message->data[0] % NEIGHBOURS;
    distance_mm[from] = estimate_distance(measured);
    last_heard[from] = (uint8_t)(kilo_ticks / 32);
}

static void setup(void) {}

static void loop(void) {
    nearest_mm = 255;
    sum_mm = 0;
    for (uint8_t i = 0; i < NEIGHBOURS; i++) {
        if (distance_mm[i] == 0 || (uint8_t)(kilo_ticks / 32 - last_heard[i]) > 3) continue;
        sum_mm += distance_mm[i];
        if (distance_mm[i] >= nearest_mm) continue;
        nearest_mm = distance_mm[i];
        nearest = i;
    }
    locked = 1;
    said.data[0] = (uint8_t)kilo_uid;
    said.data[1] = nearest_mm;
    said.crc = message_crc(&said);
    locked = 0;
    set_color(RGB(nearest & 3, sum_mm >> 5 & 3, left_out & 3));
}

int main(void) {
    kilo_init();
    kilo_message_tx = say;
    kilo_message_rx = hear;
    kilo_start(setup, loop);
    return 0;
}
