/// Neighbours heard lately: a table of distinct senders and when each was heard last.
///
/// Made for one writer that interrupts one reader: neighbours_heard() is called by the message
/// callback, neighbours_count() by loop(), and the count is right although messages come in
/// meanwhile. No locks, no interrupts switched off (that would spoil the message being received).
///
/// Ticks are taken in 32 bits and kept in 16. That stays right over any time, silent hours
/// included, because no entry grows older than 2^16 ticks unnoticed.
#ifndef AGGREGATION_NEIGHBOURS_H
#define AGGREGATION_NEIGHBOURS_H

#include <stdint.h>

/// Places there is memory for.
#define NEIGHBOURS_MAX 100
/// Largest time-out, in ticks (17.5 minutes).
#define NEIGHBOURS_TIMEOUT_MAX 32000

/// 416 bytes. The caller owns it; `dropped` may be read by anyone.
typedef struct {
    uint32_t latest;                 ///< tick of the last message of all
    uint32_t swept;                  ///< when expired senders were last removed
    uint16_t uid[NEIGHBOURS_MAX];    ///< in the order in which they are usually heard
    uint16_t heard[NEIGHBOURS_MAX];  ///< tick of each sender's last message, low 16 bits
    uint16_t timeout_ticks;
    uint16_t dropped;  ///< messages of senders for whom there was no place; saturates
    uint8_t capacity;
    uint8_t used;
    uint8_t next;              ///< the place where the next sender is looked for first
    volatile uint8_t changes;  ///< counts writes, so that the reader notices one
} neighbours_t;

/// An empty table. `capacity` 1..NEIGHBOURS_MAX; a sender's place is given back once nothing has
/// been heard from it for more than `timeout_ticks`, 1..NEIGHBOURS_TIMEOUT_MAX.
void neighbours_init(neighbours_t *table, uint8_t capacity, uint16_t timeout_ticks);

/// A message of `uid` came in at `now`, which must not be before any earlier call's. A new sender
/// that finds the table full, expired places given back, replaces nobody: `dropped` counts it.
///
/// Costs a handful of instructions if the senders are heard in the same order as last time, as
/// robots are that send once in a fixed period; else up to one pass over the table.
void neighbours_heard(neighbours_t *table, uint16_t uid, uint32_t now);

/// The number of distinct senders heard at most `window_ticks` before `now` (the limit included).
/// Those timed out do not count, however long the window. `now` may lag behind the last message.
/// One pass over the table, again if a message comes in during it.
uint8_t neighbours_count(const neighbours_t *table, uint32_t now, uint16_t window_ticks);

#endif
