// Says its uid each message period, and shows how many messages it heard, modulo 64.
#include <kilolib.h>

message_t out;
volatile uint8_t heard, distance_mm, from;

static void on_message(message_t *message, distance_measurement_t *distance) {
    heard++;
    distance_mm = estimate_distance(distance);
    from = message->data[0];
}

static message_t *say(void) { return &out; }

static void setup(void) {
    rand_seed(rand_hard());
    out.data[0] = (uint8_t)kilo_uid;
    out.type = NORMAL;
    out.crc = message_crc(&out);
}

static void loop(void) { set_color(heard & 63); }

int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_message_tx = say;
    kilo_start(setup, loop);
    return 0;
}
