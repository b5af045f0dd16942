/// A robot of the state machine's tests: parameters, neighbours, machine and floor, stepped tick by
/// tick without an API around it.
#ifndef FIRMWARE_TESTS_PFSM_ROBOT_H
#define FIRMWARE_TESTS_PFSM_ROBOT_H

#include <string.h>

#include "pfsm.h"
#include "support.h"

// A foot-bot's parameters, each long enough to be told from the others.
#define UPDATE 61
#define STRAIGHT 153
#define ENTRY 305
#define STEP 3
#define WINDOW 18

#define BLACK 1
#define WHITE 2

typedef struct {
    params_t params;
    neighbours_t neighbours;
    pfsm_t machine;
    pfsm_floor_t floor;
    uint32_t now;
} robot_t;

static inline void boot(robot_t *r, uint32_t now) {
    r->now = now;
    r->floor = (pfsm_floor_t){0, PFSM_FLOOR_UNKNOWN};
    neighbours_init(&r->neighbours, 100, 76);
    pfsm_init(&r->machine, &r->params, now, 1, 1);
}

// Parameters only: boot() comes after a test has set its own.
static inline robot_t simplified(void) {
    robot_t r;
    memset(&r, 0xA5, sizeof r);
    params_reset(&r.params);
    r.params.UPDATE_TICKS = UPDATE;
    r.params.STRAIGHT_TICKS = STRAIGHT;
    r.params.ENTRY_TICKS = ENTRY;
    r.params.STEP_TICKS = STEP;
    r.params.WINDOW_TICKS = WINDOW;
    r.params.TURN_TICKS_PER_RAD = 1398101;
    r.params.EMPTY_WINDOWS = 1;
    r.params.LEAVE_TURN = 0;
    return r;
}

static inline robot_t firat(void) {
    robot_t r = simplified();
    r.params.RULE = RULE_FIRAT;
    return r;
}

static inline bool step(robot_t *r) {
    return pfsm_step(&r->machine, &r->params, &r->neighbours, r->now, r->floor);
}

// To the end of this tick and the next one's step.
static inline void tick(robot_t *r) {
    r->now++;
    step(r);
}

static inline void ticks(robot_t *r, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) tick(r);
}

static inline void stand_on(robot_t *r, uint8_t site) {
    r->floor = (pfsm_floor_t){site, 0};
    tick(r);
}

static inline void hear(robot_t *r, uint8_t count) {
    for (uint8_t i = 0; i < count; i++) neighbours_heard(&r->neighbours, (uint16_t)(i + 2), r->now);
}

// Booted on the grey floor, a tick ago.
static inline void start(robot_t *r) {
    boot(r, 1000);
    stand_on(r, 0);
}

// Started, came onto the site, and rests there since this very tick.
static inline void start_and_rest(robot_t *r, uint8_t site) {
    start(r);
    stand_on(r, site);
    ticks(r, ENTRY);
    assert_int_equal(r->machine.state, PFSM_REST);
}

// Ticks until the state is no longer `state`, hearing `heard` robots all the time.
static inline uint32_t ticks_in(robot_t *r, uint8_t state, uint8_t heard) {
    for (uint32_t count = 0; count < 5000; count++) {
        if (r->machine.state != state) return count;
        r->now++;
        hear(r, heard);
        step(r);
    }
    return UINT32_MAX;
}

// A robot that leaves at its first test tells when that was.
static inline robot_t leaves_at_once(void) {
    robot_t r = simplified();
    r.params.ALPHA = UINT32_MAX;
    r.params.BETA = 0;
    return r;
}

#endif
