/// Turns of the four cells to repeat their messages by infrared: one turn every four ticks, the
/// cells in order (hardware.md 3.4).
///
/// Timer 0 counts units of 128 us; a compare match is a tick (timer.h). An ordinary tick adds 255
/// to a clock, and past 977 units the next cell has its turn. A cell that finds the channel busy
/// gives its turn up and starts the timer anew with a random match: the next tick comes early, and
/// counts. One that finds the receiver in the middle of a frame keeps its turn and tries again at
/// the next tick.
///
/// Pure: the driver owns the turns_t, which belongs to the timer's interrupt, and the timer.
#ifndef MODULE_CORE_TURNS_H
#define MODULE_CORE_TURNS_H

#include <stdbool.h>
#include <stdint.h>

#include "../../../firmware/kilolib/core/timer.h"
#include "../include/module_limits.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A turn comes when the clock is past this many units.
#define TURNS_PERIOD 977
/// The receiver listens to one cell for so many units, 10.24 ms, then to the next.
#define TURNS_DWELL_UNITS 80

typedef struct {
    uint16_t clock;      ///< units since the last turn
    uint16_t increment;  ///< units that the next tick adds
    uint8_t cell;        ///< that had the last turn
} turns_t;

/// module_init(): the first turn is four ticks away. The cell is kept.
static inline void turns_init(turns_t *turns) {
    turns->clock = 0;
    turns->increment = TICK_MATCH;
}

/// A tick. True if it brings a turn: then turns_passed() or turns_retry() follows, unless a frame
/// was coming in.
static inline bool turns_tick(turns_t *turns) {
    turns->clock = (uint16_t)(turns->clock + turns->increment);
    turns->increment = TICK_MATCH;
    return turns->clock > TURNS_PERIOD;
}

/// Whether the next tick brings a turn.
static inline bool turns_due_at_next_tick(const turns_t *turns) {
    return (uint16_t)(turns->clock + turns->increment) > TURNS_PERIOD;
}

/// Ticks up to and including the one that brings the next turn, 1..4: turns_tick() is false before
/// it, if no attempt starts the timer anew. At least 1 also while a turn is open.
static inline uint8_t turns_ticks_to_go(const turns_t *turns) {
    if (turns_due_at_next_tick(turns)) return 1;
    const uint16_t missing = (uint16_t)(TURNS_PERIOD - turns->clock - turns->increment);
    return (uint8_t)(missing / TICK_MATCH + 2);
}

/// The cell whose turn is next, or open.
static inline uint8_t turns_next_cell(const turns_t *turns) {
    return (uint8_t)((turns->cell + 1) % N_CELLS);
}

/// The turn is over: the cell sent, or had nothing to send.
static inline void turns_passed(turns_t *turns) {
    turns->cell = turns_next_cell(turns);
    turns->clock = 0;
}

/// The turn is over: the channel was busy. `drawn` is libc's rand(). Returns the units after which
/// the timer, started anew, makes the next tick: 1..256.
static inline uint16_t turns_retry(turns_t *turns, int drawn) {
    const uint8_t match = (uint8_t)drawn;
    turns_passed(turns);
    turns->increment = match == 0 ? TICK_MATCH + 1 : match;
    return turns->increment;
}

/// The cell that the receiver listens to `dwells` dwells after `cell`. A dwell that ends while a
/// frame is coming in does not count: the receiver stays.
static inline uint8_t turns_listening_after(uint8_t cell, uint8_t dwells) {
    return (uint8_t)((cell + dwells) % N_CELLS);
}

#ifdef __cplusplus
}
#endif

#endif
