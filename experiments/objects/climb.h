/// Climbs a value by arcs: light, say, or how near something is.
///
/// With one sensor that knows no directions a robot turns to one side until the value has become
/// larger and falls again, then to the other. A turn leads forwards along an arc, so it climbs.
#ifndef CLIMB_H
#define CLIMB_H

#include <kilolib.h>
#include <stdbool.h>

static bool turns_left;
static bool value_grows;
static uint16_t value_extreme;  // the largest while it grows, else the smallest

static inline uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static inline void turn(bool to_left) {
    turns_left = to_left;
    spinup_motors();
    set_motors(turns_left ? kilo_turn_left : 0, turns_left ? 0 : kilo_turn_right);
}

static inline void go_straight(void) {
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
}

/// Takes the next value; changes of up to `noise` say nothing. The robot is turning.
static inline void climb(uint16_t value, uint16_t noise) {
    const bool further = value_grows ? value > value_extreme : value < value_extreme;
    const uint16_t back = (uint16_t)(value_grows ? value_extreme - value : value - value_extreme);
    if (further) {
        value_extreme = value;
    } else if (back > noise) {
        value_extreme = value;
        value_grows = !value_grows;
        if (!value_grows) turn(!turns_left);
    }
}

/// Adds up eight readings of the light, so that noise becomes smaller. True when there is a sum.
static inline bool sum_light(uint16_t *sum) {
    static uint8_t samples;
    static uint16_t so_far;
    const int16_t light = get_ambientlight();
    if (light < 0) return false;  // a message is being received, which needs the same converter
    so_far = (uint16_t)(so_far + (uint16_t)light);
    if (++samples < 8) return false;
    *sum = so_far;
    samples = 0;
    so_far = 0;
    return true;
}

#endif
