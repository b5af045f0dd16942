/// The robot's probabilistic finite state machine: decides, never acts.
///
/// No input or output, no clock, no statics, no floating point: the caller owns the memory, passes
/// in time, floor and the table of neighbours, and makes motors, LED and messages do what the
/// machine says. The same inputs give the same outputs on a PC and on an AVR, bit for bit.
///
///     WALK --onto a site--> ENTER --ENTRY_TICKS--> REST --leave test--> LEAVE --off it--> WALK
///
/// Two rules, simplified and Firat, and informed robots in each. What a robot does is chosen by
/// parameters (wire.h); this is what each means exactly. A robot's *site* is the site number of
/// the last CELL message, for as long as no other comes; its *home* is the site it last entered.
///
/// WALK     A random walk (walk.h). Coming onto a site is an edge: the site is not 0 and differs
///          from the one before. Who comes onto a site that it may join, enters it; from then on it
///          counts that site as its home. An informed robot may join its own site only, all others
///          it walks over as if they were not there; every other robot may join any. A Firat robot
///          that is not informed must perceive an informed robot, that is hear a signal (the count
///          is x of the leave rule), at the time that FIRAT_JOIN says:
///            0 crossing      at the edge; if there is none, not before the next edge
///            1 first_update  at the first update after the edge, if it is still on the site
///            2 every_update  at every update while it is on the site
///          Updates come each UPDATE_TICKS after the edge, by the robot's own clock.
///          START_ON_SITE: the first CELL is an edge if it names a site (0), or never is (1).
/// ENTER    Straight on for ENTRY_TICKS, then REST. ENTRY_OBSTACLE, if the way is blocked:
///            0 turn   turns away and goes on, as in WALK, while the time runs
///            1 rest   rests at once
///            2 pause  as turn, but the time stands still during turns
///          WALK_OUT, if the site ceases to be its home: 0 back to WALK, 1 REST at once. A wall
///          cell's warning counts as an obstacle here and everywhere.
/// REST     Motors off. A robot that is not informed tests whether to leave each UPDATE_TICKS;
///          FIRST_LEAVE: the first test is STEP_TICKS (0) or UPDATE_TICKS (1) after coming to rest.
///          With SIGNAL_FROM 1 (crossing) it tests in ENTER too: the same, from the edge on, and
///          coming to rest does not start the clock again.
///          It leaves with the probability of leave.h, n = distinct senders heard at most
///          WINDOW_TICKS ago. COUNT_SELF 1 adds one to n by the simplified rule (by Firat's a robot
///          that tests is not informed, so never one of those counted). By Firat's rule n = 0 in
///          EMPTY_WINDOWS tests in a row means P = 1, and in fewer P = 0.
///          A robot pushed off its home rests on, or, if PUSHED_OFF is 1 and WALK_OUT 0, is in WALK
///          with a fresh leg.
/// LEAVE    As WALK, but straight on, without random turns (LEAVE_TURN 0) or with them after each
///          leg (1), until the site ceases to be its home; then WALK with a fresh leg. If it is not
///          at home when it decides to leave, it is in WALK at once. Coming onto another site in
///          this way is an edge, the site that is left needs a new one.
///
/// UPDATE_CLOCK 1 (common) puts off every test and update to the next multiple of UPDATE_TICKS
/// since pfsm_init(); the first update after an edge is then the first multiple after it.
///
/// Signals are sent in REST, and from the edge on, in ENTER, if SIGNAL_FROM is 1 (simplified rule,
/// every robot) or FIRAT_SIGNAL_FROM is 0 (Firat's rule, informed robots only).
#ifndef AGGREGATION_PFSM_H
#define AGGREGATION_PFSM_H

#include <stdbool.h>
#include <stdint.h>

#include "neighbours.h"
#include "params.h"
#include "random.h"
#include "ticks.h"
#include "walk.h"

typedef enum { PFSM_WALK, PFSM_ENTER, PFSM_REST, PFSM_LEAVE } pfsm_state_t;

/// The floor's last word: site and flags of the CELL message, flags = PFSM_FLOOR_UNKNOWN and
/// site = 0 before the first one.
typedef struct {
    uint8_t site;
    uint8_t flags;
} pfsm_floor_t;

#define PFSM_FLOOR_UNKNOWN 0x80

/// The caller owns it. `state` and `walk` are for reading.
typedef struct {
    uint32_t wake;   ///< before this tick nothing changes unless the floor does
    uint32_t start;  ///< when the common clock started
    uint32_t entry_end;
    uint32_t test_at;  ///< next test whether to leave
    uint32_t join_at;  ///< next test whether to enter
    random_t random;
    walk_t walk;
    pfsm_floor_t floor;
    uint8_t state;  ///< a pfsm_state_t
    uint8_t home;
    uint8_t joined_with;  ///< Firat's x
    uint8_t empty_windows;
    bool joining;  ///< on a site it may join, and `join_at` is still to come
} pfsm_t;

/// The start, at `now`: walking, the first leg straight on. `seed` and `uid` start its luck.
void pfsm_init(pfsm_t *machine, const params_t *params, uint32_t now, uint32_t seed, uint16_t uid);

/// The part of pfsm_step() that something may change in.
void pfsm_change(pfsm_t *machine, const params_t *params, const neighbours_t *neighbours,
                 uint32_t now, pfsm_floor_t floor);

/// Brings the machine up to `now`. Call it once a tick. Calls may be late, after a pause by any
/// length of time: what was due happens then, once.
/// Returns false, after a few comparisons, if nothing can have changed. Does not call for
/// neighbours_count() but at tests. The parameters must not change after pfsm_init().
static inline bool pfsm_step(pfsm_t *machine, const params_t *params,
                             const neighbours_t *neighbours, uint32_t now, pfsm_floor_t floor) {
    const pfsm_floor_t *known = &machine->floor;
    const bool same_floor = floor.site == known->site && floor.flags == known->flags;
    if (same_floor && !ticks_reached(now, machine->wake)) return false;
    pfsm_change(machine, params, neighbours, now, floor);
    return true;
}

/// Whether the robot sends signals now.
bool pfsm_signals(const pfsm_t *machine, const params_t *params);

#endif
