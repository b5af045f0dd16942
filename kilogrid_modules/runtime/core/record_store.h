/// Store of the tracking records that wait for the host's next poll: a ring of ten places.
///
/// The ring counts places only; the driver owns the records. Bytes alone, so that it has one layout
/// for every compiler: in the emulator it lies in the memory of the module's program. Every
/// function is a few instructions; a program adds records from interrupts as well as from loop(),
/// so that the driver calls them with interrupts off.
#ifndef MODULE_CORE_RECORD_STORE_H
#define MODULE_CORE_RECORD_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "../include/module_limits.h"

/// Starts zeroed.
typedef struct {
    uint8_t first;          ///< place of the oldest record
    volatile uint8_t used;  ///< records that wait, 0..CAN_MESSAGE_BUFFER_SIZE
    volatile uint8_t lost;  ///< records without a place since power-up; stays at 255
} record_store_t;

/// No place is free.
#define RECORD_STORE_FULL 0xFF

/// The place for a new record, which counts as waiting from now on; RECORD_STORE_FULL, and counted,
/// if there is none.
static inline uint8_t record_store_add(record_store_t *store) {
    if (store->used < CAN_MESSAGE_BUFFER_SIZE) {
        const uint8_t place = (uint8_t)(store->first + store->used) % CAN_MESSAGE_BUFFER_SIZE;
        store->used = (uint8_t)(store->used + 1);
        return place;
    }
    if (store->lost < UINT8_MAX) store->lost = (uint8_t)(store->lost + 1);
    return RECORD_STORE_FULL;
}

/// The place of the oldest record, which has to be read before the next record_store_add(). Only
/// while records wait.
static inline uint8_t record_store_take(record_store_t *store) {
    const uint8_t place = store->first;
    store->first = (uint8_t)((place + 1) % CAN_MESSAGE_BUFFER_SIZE);
    store->used = (uint8_t)(store->used - 1);
    return place;
}

/// Throws away what waits: the robots start anew.
static inline void record_store_clear(record_store_t *store) { store->used = 0; }

#endif
