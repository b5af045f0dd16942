/// Walks at random, and turns where a wall of light tells it to (wall.py).
///
/// A word of type 1 is the direction to turn to: sectors of 22.5 degrees, counter-clockwise from
/// where the robot looks. LED: green while it walks, red while it turns from a wall.
#include "ark.h"
#include "drive.h"

#define WALL 1
#define LEG_TICKS 120  // about 4 s straight on, then a turn at random

static volatile bool told;
static volatile uint8_t told_direction;
static uint32_t leg_ends;

static void on_message(message_t *message, distance_measurement_t *distance) {
    ark_word_t word;
    (void)distance;
    if (!ark_find(message, &word) || word.type != WALL) return;
    told_direction = (uint8_t)(word.value % SECTORS);
    told = true;
}

static void setup(void) {
    rand_seed(rand_hard());
    set_color(RGB(0, 3, 0));
    leg_ends = ticks_now() + rand_soft();
    go_straight();
}

static void loop(void) {
    if (told) {
        told = false;
        set_color(RGB(3, 0, 0));
        turn_to(told_direction);
    } else if (turning && reached(turned_at)) {
        set_color(RGB(0, 3, 0));
        leg_ends = ticks_now() + LEG_TICKS;
        go_straight();
    } else if (!turning && reached(leg_ends)) {
        turn_to(rand_soft() % SECTORS);
    }
}

int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
