/// Walks at random and counts its neighbours: straight on for 2 to 6 s, a turn of 0.5 to 2.5 s to
/// either side, and so on; once a second, how many different robots were heard in that second.
///
/// LED: off for no neighbour, red for one, yellow for two, green for three, blue for four or more.
#include <kilolib.h>
#include <stdbool.h>

#define TYPE_HERE 2
#define CAPACITY 16
#define STRAIGHT_MIN_TICKS 61
#define STRAIGHT_SPAN_TICKS 122
#define TURN_MIN_TICKS 15
#define TURN_SPAN_TICKS 61

static const uint8_t COLOURS[] = {RGB(0, 0, 0), RGB(3, 0, 0), RGB(3, 3, 0), RGB(0, 3, 0),
                                  RGB(0, 0, 3)};

static message_t message;

// The callback fills the table, loop() empties it by its count, a single byte.
static uint16_t heard[CAPACITY];
static volatile uint8_t heard_count;

static bool straight;
static uint32_t leg_began, second_began;
static uint8_t leg_ticks;

static void on_message(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    if (received->type != TYPE_HERE) return;
    const uint16_t uid = (uint16_t)(received->data[0] | received->data[1] << 8);
    const uint8_t count = heard_count;
    for (uint8_t i = 0; i < count; i++) {
        if (heard[i] == uid) return;
    }
    if (count == CAPACITY) return;
    heard[count] = uid;
    heard_count = (uint8_t)(count + 1);
}

static message_t *on_transmit(void) { return &message; }

static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static uint8_t between(uint8_t least, uint8_t span) {
    return (uint8_t)(least + ((uint16_t)rand_soft() * (span + 1u) >> 8));
}

static void next_leg(uint32_t now) {
    straight = !straight;
    leg_began = now;
    spinup_motors();
    if (straight) {
        leg_ticks = between(STRAIGHT_MIN_TICKS, STRAIGHT_SPAN_TICKS);
        set_motors(kilo_straight_left, kilo_straight_right);
    } else {
        leg_ticks = between(TURN_MIN_TICKS, TURN_SPAN_TICKS);
        const bool left = rand_soft() < 128;
        set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
    }
}

static void count_neighbours(void) {
    const uint8_t count = heard_count;
    heard_count = 0;  // one that comes in between is heard again next time
    set_color(COLOURS[count < sizeof COLOURS ? count : sizeof COLOURS - 1]);
}

// rand_soft() gives the same numbers on every robot unless it is seeded with something of its own.
static void setup(void) {
    rand_seed(rand_hard());
    second_began = ticks_now();
    next_leg(second_began);
}

static void loop(void) {
    const uint32_t now = ticks_now();
    if (now - leg_began >= leg_ticks) next_leg(now);
    if (now - second_began >= TICKS_PER_SEC) {
        second_began += TICKS_PER_SEC;
        count_neighbours();
    }
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = on_transmit;
    kilo_init();

    message.type = TYPE_HERE;
    message.data[0] = (uint8_t)kilo_uid;
    message.data[1] = (uint8_t)(kilo_uid >> 8);
    message.crc = message_crc(&message);
    kilo_start(setup, loop);
    return 0;
}
