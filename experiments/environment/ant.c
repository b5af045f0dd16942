/// Fetches food from a place that a virtual environment has, along a trail that it lays there
/// (pheromone.py).
///
/// Each word tells what is here (nothing, nest, food), where a trail leads, and where the nest is.
/// Without food the robot follows a trail, or walks at random; with food it goes to the nest. The
/// environment lays pheromone below robots that show blue. LED: green without food, blue with it.
#include "ark.h"
#include "drive.h"

#define LEG_TICKS 150    // about 5 s straight on, then a turn at random
#define STEADY_TICKS 45  // after a turn: what was seen during it comes too late
#define LOST_TICKS 90    // so long a trail is remembered

enum { NOTHING, NEST, FOOD };

// value: what is here (2 bits); the trail, 0 for none, else 1 to 9 from right to left (4); the
// direction of the nest (4).
static volatile uint16_t told_value;
static volatile bool told;

static bool carries;
static uint32_t leg_ends, trail_lost;

static void on_message(message_t *message, distance_measurement_t *distance) {
    ark_word_t word;
    (void)distance;
    if (!ark_find(message, &word)) return;
    told_value = word.value;
    told = true;
}

static uint16_t take_word(void) {
    told = false;
    uint16_t value = told_value;
    while (value != told_value) value = told_value;
    return value;
}

static void take(bool food, uint8_t direction) {
    carries = food;
    set_color(food ? RGB(0, 0, 3) : RGB(0, 3, 0));
    turn_to(direction);
}

static void steer(uint8_t direction) {
    if (direction > 1 && direction < SECTORS - 1) turn_to(direction);
}

static void heed(uint16_t value) {
    const uint8_t here = (uint8_t)(value >> 8), trail = value >> 4 & 0x0F, home = value & 0x0F;
    if (!carries && here == FOOD) {
        take(true, home);
    } else if (carries && here == NEST) {
        take(false, SECTORS / 2);
    } else if (turning || !reached(turned_at + STEADY_TICKS)) {
        return;
    } else if (carries) {
        steer(home);
    } else if (trail > 0) {
        trail_lost = ticks_now() + LOST_TICKS;
        steer((uint8_t)(trail + SECTORS - 5) % SECTORS);
    }
}

static void setup(void) {
    rand_seed(rand_hard());
    set_color(RGB(0, 3, 0));
    leg_ends = turned_at = trail_lost = ticks_now();
    leg_ends += rand_soft();
    go_straight();
}

static void loop(void) {
    if (told) heed(take_word());
    if (turning && reached(turned_at)) {
        leg_ends = ticks_now() + LEG_TICKS;
        go_straight();
    }
    if (!carries && !turning && reached(leg_ends) && reached(trail_lost))
        turn_to(rand_soft() % SECTORS);
}

int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
