/// Transmit clock: when a robot's program is asked for a message, and when again after a failed
/// attempt (hardware.md 1.6).
///
/// Each compare match of timer 0 adds its counts to the clock and is a tick. Once the clock exceeds
/// kilo_tx_period the program is asked at every match, until a message has gone out. An attempt
/// that finds the channel busy moves the compare value to a random count: the match there is an
/// extra tick, so that ticks are faster where it is crowded.
///
/// The first half is for every driver; called from the timer's interrupt. The second half is for
/// drivers that have no timer 0 and compute its matches: all of it is pure, in cycles of 125 ns,
/// and takes constant time.
#ifndef KILOLIB_CORE_TRANSMIT_CLOCK_H
#define KILOLIB_CORE_TRANSMIT_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "timer.h"

#ifdef __cplusplus
extern "C" {
#endif

/// kilo_tx_period at kilo_init(), in counts of 128 us: every 16th tick, 524.3 ms.
#define TX_PERIOD_DEFAULT 3906

typedef struct {
    uint16_t counts;    ///< since the last message sent; wraps
    uint8_t increment;  ///< counts that the next compare match stands for
} transmit_clock_t;

static inline void transmit_clock_init(transmit_clock_t *clock) {
    clock->counts = 0;
    clock->increment = TICK_MATCH;
}

/// At each compare match. The next one is an ordinary one, at TICK_MATCH.
static inline void transmit_clock_match(transmit_clock_t *clock) {
    clock->counts = (uint16_t)(clock->counts + clock->increment);
    clock->increment = TICK_MATCH;
}

/// After transmit_clock_match(): whether the program is to be asked for a message, if the robot is
/// RUNNING and receives nothing. `period` is kilo_tx_period.
static inline bool transmit_clock_is_due(const transmit_clock_t *clock, uint16_t period) {
    return clock->counts > period;
}

/// A message has gone out.
static inline void transmit_clock_sent(transmit_clock_t *clock) { clock->counts = 0; }

/// An attempt found the channel busy; `random` is what the program's rand() returned. Returns the
/// compare value for the next match.
static inline uint8_t transmit_clock_retry(transmit_clock_t *clock, int random) {
    clock->increment = (uint8_t)random;
    return clock->increment;
}

/// The next matches of timer 0.
typedef struct {
    uint64_t match;     ///< at the compare value that transmit_clock_retry() returned
    uint64_t ordinary;  ///< the one after it, at TICK_MATCH
} timer_matches_t;

/// After a retry at `now`, where the timer comes to TICK_MATCH at `ordinary` and each `tick_cycles`
/// later. There is one compare value only: if the timer has passed the new one, the match at
/// `ordinary` is left out and it comes a round later.
static inline timer_matches_t timer_matches_after_retry(uint64_t now, uint64_t ordinary,
                                                        uint8_t compare, uint64_t tick_cycles) {
    timer_matches_t next = {ordinary - (uint64_t)(TICK_MATCH - compare) * COUNT_CYCLES, ordinary};
    if (next.match <= now) {
        next.match += tick_cycles;
        next.ordinary += tick_cycles;
    }
    return next;
}

/// Compare matches up to the one at which the program is asked, the next one being 1, if nothing
/// is sent before and no attempt fails. Exact for periods up to 65,280, which covers the default;
/// beyond, the clock may wrap first, and the answer is 1: it may be any.
static inline uint32_t transmit_clock_matches_to_request(const transmit_clock_t *clock,
                                                         uint16_t period) {
    const uint16_t next = (uint16_t)(clock->counts + clock->increment);
    if (next > period || period > UINT16_MAX - TICK_MATCH) return 1;
    return (uint32_t)(period - next) / TICK_MATCH + 2;
}

/// Time of the compare match that comes as the `number`th, from 1 on, given the next ones, if no
/// attempt fails before.
static inline uint64_t timer_match(uint32_t number, timer_matches_t next, uint64_t tick_cycles) {
    return number == 1 ? next.match : next.ordinary + (number - 2) * tick_cycles;
}

/// transmit_clock_matches_to_request() as a time, given the timer's next matches.
static inline uint64_t transmit_clock_next_request(const transmit_clock_t *clock, uint16_t period,
                                                   timer_matches_t next, uint64_t tick_cycles) {
    return timer_match(transmit_clock_matches_to_request(clock, period), next, tick_cycles);
}

#ifdef __cplusplus
}
#endif

#endif
