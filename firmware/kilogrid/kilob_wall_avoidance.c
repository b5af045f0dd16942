#include "kilob_wall_avoidance.h"

#include <stdbool.h>

#include "kilo_rand_lib.h"
#include "utils.h"

// collective_perception.md 1.
#define FORGET_TICKS ((uint32_t)SEC_TO_TICKS(1))
#define TURN_TICKS MS_TO_TICKS(7500)

typedef enum { BEGIN, TURNING, GOING } phase_t;

static phase_t phase;
static direction_t side;
static uint32_t turn_until, wall_until;

// The receive callback writes these. Sums come four messages apart, so that loop() reads the last
// two long before the next one, and the rest are single bytes.
static volatile bool wall_met;
static volatile bool compared;
static volatile uint8_t readings;
static volatile uint16_t sum, newest, before;

static void restart_readings(void) {
    readings = 0;
    sum = newest = before = 0;
}

void kilob_wall_avoidance_init(void) {
    wall_met = compared = false;
    wall_until = 0;
    restart_readings();
    kilob_wall_avoidance_reset();
}

void kilob_wall_avoidance_reset(void) {
    side = UNDEFINED;
    phase = BEGIN;
}

void kilob_on_wall_detected(distance_measurement_t *distance, IR_message_t *message) {
    (void)message;
    wall_met = true;
    sum += (uint16_t)distance->high_gain;
    if (++readings < WALL_READINGS_BUFFER_SIZE) return;
    before = newest;
    newest = sum;
    readings = 0;
    sum = 0;
    compared = true;
}

// The readings of one side say nothing of the other.
static void turn_to(direction_t to) {
    side = to;
    turn_until = kilo_ticks + TURN_TICKS;
    restart_readings();
    if (to == LEFT)
        turn_left();
    else
        turn_right();
}

// Weaker light than before: the robot looks away from the wall. It may also be stuck at it.
static void keep_turning(void) {
    if (kilo_ticks > turn_until) turn_to(side == LEFT ? RIGHT : LEFT);
    if (!compared) return;
    compared = false;
    if (newest >= before) return;
    move_straight();
    phase = GOING;
}

// Stronger light than before: there is another wall ahead, or the robot turned too little.
static void keep_going(void) {
    if (!compared) return;
    compared = false;
    if (newest > before) phase = BEGIN;
}

uint8_t kilob_wall_avoidance(void) {
    if (wall_met) {
        wall_met = false;
        wall_until = kilo_ticks + FORGET_TICKS;
    }
    if (wall_until == 0 || kilo_ticks > wall_until) {
        wall_until = 0;
        kilob_wall_avoidance_reset();
        return 0;
    }
    if (phase == BEGIN) {
        turn_to(g_ran_uniform() > 0.5 ? LEFT : RIGHT);
        phase = TURNING;
    } else if (phase == TURNING) {
        keep_turning();
    } else {
        keep_going();
    }
    return 1;
}
