/// The walk of the programs of `kilotwin bench`: straight on for 2 to 6 s, a turn of 0.5 to 2.5 s to
/// either side, and so on, as firmware/examples/random_walk_counter.c. Each program includes it once
/// and differs in one thing alone.
#ifndef BENCH_WALKER_H
#define BENCH_WALKER_H

#include <kilolib.h>
#include <stdbool.h>

static bool straight;
static uint32_t leg_began;
static uint8_t leg_ticks;

static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

/// From `least` to `least + span`, all equally likely.
static uint8_t between(uint8_t least, uint8_t span) {
    return (uint8_t)(least + ((uint16_t)rand_soft() * (span + 1u) >> 8));
}

static void next_leg(uint32_t now) {
    straight = !straight;
    leg_began = now;
    spinup_motors();
    if (straight) {
        leg_ticks = between(61, 122);
        set_motors(kilo_straight_left, kilo_straight_right);
    } else {
        leg_ticks = between(15, 61);
        const bool left = rand_soft() < 128;
        set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
    }
}

/// For setup().
static void begin_to_walk(void) {
    rand_seed(rand_hard());
    next_leg(ticks_now());
}

/// For loop().
static void walk(void) {
    const uint32_t now = ticks_now();
    if (now - leg_began >= leg_ticks) next_leg(now);
}

#endif
