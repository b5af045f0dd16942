/// Straight on, and turns by so many sectors of 22.5 degrees, without waiting.
#ifndef DRIVE_H
#define DRIVE_H

#include <kilolib.h>
#include <stdbool.h>

#define SECTORS 16           // of a circle
#define TICKS_PER_SECTOR 15  // at 45 degrees a second

static bool turning;
static uint32_t turned_at;  // when the turn is over, or was

static inline uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static inline bool reached(uint32_t tick) { return (int32_t)(ticks_now() - tick) >= 0; }

static inline void go_straight(void) {
    turning = false;
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
}

/// Turns to a direction: sectors counter-clockwise from where it looks, 0 to 15.
static inline void turn_to(uint8_t direction) {
    const bool left = direction < SECTORS / 2;
    const uint8_t sectors = left ? direction : (uint8_t)(SECTORS - direction);
    turning = true;
    turned_at = ticks_now() + (uint32_t)sectors * TICKS_PER_SECTOR;
    spinup_motors();
    set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
}

#endif
