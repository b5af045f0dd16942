/// The last message, for loop(): the callback, an interrupt on the robot, does nothing but keep it.
#ifndef INBOX_H
#define INBOX_H

#include <kilolib.h>
#include <stdbool.h>

static volatile bool inbox_full;
static message_t inbox;
static uint8_t inbox_mm;  // how far away its sender is

/// To be `kilo_message_rx`. Messages that come before loop() has taken the last one are left out.
static inline void keep_message(message_t *message, distance_measurement_t *distance) {
    if (inbox_full) return;
    inbox = *message;
    inbox_mm = estimate_distance(distance);
    inbox_full = true;
}

#endif
