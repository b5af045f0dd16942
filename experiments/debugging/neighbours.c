/// Walks about, and notes the neighbours that it has met. With a bug: docs/debugging.md finds it.
#include <kilolib.h>

static struct {
    uint8_t uids[6];  ///< neighbours that it has met
    uint8_t alarm;    ///< a robot is in need: red light, for good
} met;
static uint8_t met_count;
static message_t greeting = {.type = NORMAL};

static void note_neighbour(uint8_t uid) {
    for (uint8_t i = 0; i < met_count; i++)
        if (met.uids[i] == uid) return;
    met.uids[met_count++] = uid;
}

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    note_neighbour(message->data[0]);
    if (message->data[1]) met.alarm = 1;
}

static message_t *report_greeting(void) { return &greeting; }

static void setup(void) {
    greeting.data[0] = (uint8_t)kilo_uid;
    greeting.crc = message_crc(&greeting);
    rand_seed(rand_hard());
    set_color(RGB(0, 1, 0));
}

static void loop(void) {
    if (met.alarm) set_color(RGB(3, 0, 0));
    const uint8_t dice = rand_soft();
    spinup_motors();
    set_motors(dice % 4 ? kilo_straight_left : 0, dice % 4 != 1 ? kilo_straight_right : 0);
    delay(500);
}

int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_message_tx = report_greeting;
    kilo_start(setup, loop);
    return 0;
}
