#include "pfsm.h"

#include "exponential.h"
#include "leave.h"
#include "ticks.h"

// Farther off than any deadline, and near enough to compare.
#define NEVER_TICKS UINT32_C(0x40000000)

static bool is_informed(const params_t *p) { return p->INFORMED_SITE != 0; }

void pfsm_init(pfsm_t *m, const params_t *p, uint32_t now, uint32_t seed, uint16_t uid) {
    *m = (pfsm_t){.wake = now, .start = now, .floor = {0, PFSM_FLOOR_UNKNOWN}, .state = PFSM_WALK};
    random_seed(&m->random, seed, uid);
    walk_init(&m->walk, now);
    walk_straight(&m->walk, p, now);
}

// The first tick from `earliest` on at which the robot's clock allows a test.
static uint32_t test_time(const pfsm_t *m, const params_t *p, uint32_t earliest) {
    if (p->UPDATE_CLOCK == UPDATE_CLOCK_OWN) return earliest;
    const uint16_t past = (uint16_t)((earliest - m->start) % p->UPDATE_TICKS);
    return past == 0 ? earliest : earliest + (p->UPDATE_TICKS - past);
}

// One period on by its own clock, however late `now` is: tests missed during a pause are not made
// up for.
static uint32_t next_update(const pfsm_t *m, const params_t *p, uint32_t now) {
    return test_time(m, p, p->UPDATE_CLOCK == UPDATE_CLOCK_OWN ? now + p->UPDATE_TICKS : now + 1);
}

static void start_leave_tests(pfsm_t *m, const params_t *p, uint32_t now) {
    const bool soon = p->FIRST_LEAVE == FIRST_LEAVE_NEXT_STEP;
    m->test_at = test_time(m, p, now + (soon ? p->STEP_TICKS : p->UPDATE_TICKS));
}

static void enter(pfsm_t *m, const params_t *p, uint32_t now, uint8_t n) {
    m->state = PFSM_ENTER;
    m->home = m->floor.site;
    m->joining = false;
    m->joined_with = n;
    m->empty_windows = 0;
    m->entry_end = now + p->ENTRY_TICKS;
    walk_straight(&m->walk, p, now);
    if (p->SIGNAL_FROM == SIGNAL_FROM_CROSSING) start_leave_tests(m, p, now);
}

static void rest(pfsm_t *m, const params_t *p, uint32_t now) {
    m->state = PFSM_REST;
    walk_stop(&m->walk);
    if (p->SIGNAL_FROM == SIGNAL_FROM_REST) start_leave_tests(m, p, now);
}

// A robot that was pushed off its site meanwhile has nothing to leave.
static void leave(pfsm_t *m, const params_t *p, uint32_t now) {
    m->state = m->floor.site == m->home ? PFSM_LEAVE : PFSM_WALK;
    walk_straight(&m->walk, p, now);
}

// Takes over what the floor says. True if the robot has come onto a site.
static bool notice_floor(pfsm_t *m, const params_t *p, pfsm_floor_t floor) {
    const bool first = (m->floor.flags & PFSM_FLOOR_UNKNOWN) != 0;
    const bool changed = floor.site != m->floor.site;
    m->floor = floor;
    if (!changed) return false;
    m->joining = false;
    return floor.site != 0 && !(first && p->START_ON_SITE == START_ON_SITE_MUST_LEAVE);
}

// Whether one that rests off its site was pushed there and heeds it. By WALK_OUT_REST it came to
// rest there by itself.
static bool heeds_push(const pfsm_t *m, const params_t *p) {
    return m->state == PFSM_REST && p->PUSHED_OFF == PUSHED_OFF_WALK &&
           p->WALK_OUT == WALK_OUT_WALK;
}

// The robot is not on its home any more.
static void step_off(pfsm_t *m, const params_t *p, uint32_t now) {
    if (m->state == PFSM_ENTER && p->WALK_OUT == WALK_OUT_REST) {
        rest(m, p, now);
    } else if (m->state == PFSM_ENTER || m->state == PFSM_LEAVE || heeds_push(m, p)) {
        m->state = PFSM_WALK;
        walk_straight(&m->walk, p, now);
    }
}

static bool must_perceive(const params_t *p) { return p->RULE == RULE_FIRAT && !is_informed(p); }

static uint32_t first_join_test(const pfsm_t *m, const params_t *p, uint32_t now) {
    if (!must_perceive(p) || p->FIRAT_JOIN == FIRAT_JOIN_CROSSING) return now;
    return next_update(m, p, now);
}

static uint8_t neighbours_now(const params_t *p, const neighbours_t *neighbours, uint32_t now) {
    return neighbours_count(neighbours, now, p->WINDOW_TICKS);
}

static void join(pfsm_t *m, const params_t *p, const neighbours_t *neighbours, uint32_t now,
                 bool edge) {
    // A site that is not joined now is crossed in ignorance of it: only `joining` remembers it.
    if (edge) {
        m->joining = !is_informed(p) || p->INFORMED_SITE == m->floor.site;
        m->join_at = first_join_test(m, p, now);
    }
    if (!m->joining || !ticks_reached(now, m->join_at)) return;

    const uint8_t n = neighbours_now(p, neighbours, now);
    if (n > 0 || !must_perceive(p)) {
        enter(m, p, now, n);
    } else if (p->FIRAT_JOIN == FIRAT_JOIN_EVERY_UPDATE) {
        m->join_at = next_update(m, p, now);
    } else {
        m->joining = false;
    }
}

// The entry walk as far as time and obstacles may end it; its motion is move()'s business.
static void go_in(pfsm_t *m, const params_t *p, uint32_t now) {
    const bool blocked = walk_blocked(&m->walk, now, m->floor.flags);
    if (ticks_reached(now, m->entry_end) || (blocked && p->ENTRY_OBSTACLE == ENTRY_OBSTACLE_REST)) {
        rest(m, p, now);
    }
}

static bool tests_leaving(const pfsm_t *m, const params_t *p) {
    if (is_informed(p)) return false;
    return m->state == PFSM_REST ||
           (m->state == PFSM_ENTER && p->SIGNAL_FROM == SIGNAL_FROM_CROSSING);
}

static uint64_t leave_probability(pfsm_t *m, const params_t *p, uint8_t n) {
    if (p->RULE == RULE_SIMPLIFIED) {
        return leave_simplified(p->ALPHA, p->BETA, (uint8_t)(n + p->COUNT_SELF));
    }
    if (n == 0) return ++m->empty_windows >= p->EMPTY_WINDOWS ? EXPONENTIAL_ONE : 0;
    m->empty_windows = 0;
    return leave_firat(p->FIRAT_A, p->FIRAT_K, n, m->joined_with);
}

static void test_leaving(pfsm_t *m, const params_t *p, const neighbours_t *neighbours,
                         uint32_t now) {
    m->test_at = next_update(m, p, now);
    // One draw a test, whatever the probability: luck does not depend on the neighbours.
    const uint64_t threshold = leave_probability(m, p, neighbours_now(p, neighbours, now));
    if (random_next(&m->random) < threshold) leave(m, p, now);
}

static bool walks_in_legs(const pfsm_t *m, const params_t *p) {
    return m->state == PFSM_WALK || (m->state == PFSM_LEAVE && p->LEAVE_TURN);
}

static void move(pfsm_t *m, const params_t *p, uint32_t now) {
    const uint32_t turn_ticks =
        walk_step(&m->walk, p, &m->random, now, m->floor.flags, walks_in_legs(m, p));
    if (p->ENTRY_OBSTACLE == ENTRY_OBSTACLE_PAUSE) m->entry_end += turn_ticks;
}

static uint32_t next_wake(const pfsm_t *m, const params_t *p, uint32_t now) {
    uint32_t wake = m->state == PFSM_REST
                        ? now + NEVER_TICKS
                        : walk_wake(&m->walk, now, m->floor.flags, walks_in_legs(m, p));
    if (m->joining) wake = ticks_earlier(wake, m->join_at);
    if (m->state == PFSM_ENTER) wake = ticks_earlier(wake, m->entry_end);
    if (tests_leaving(m, p)) wake = ticks_earlier(wake, m->test_at);
    return wake;
}

void pfsm_change(pfsm_t *m, const params_t *p, const neighbours_t *neighbours, uint32_t now,
                 pfsm_floor_t floor) {
    // One tick may take the robot through several states: off one site, onto the next, at rest.
    const bool edge = notice_floor(m, p, floor);
    if (m->floor.site != m->home) step_off(m, p, now);
    if (m->state == PFSM_WALK) join(m, p, neighbours, now, edge);
    if (m->state == PFSM_ENTER) go_in(m, p, now);
    if (tests_leaving(m, p) && ticks_reached(now, m->test_at)) test_leaving(m, p, neighbours, now);
    if (m->state != PFSM_REST) move(m, p, now);

    m->wake = next_wake(m, p, now);
}

bool pfsm_signals(const pfsm_t *m, const params_t *p) {
    const bool firat = p->RULE == RULE_FIRAT;
    if (firat && !is_informed(p)) return false;
    if (m->state == PFSM_REST) return true;
    const bool from_crossing = firat ? p->FIRAT_SIGNAL_FROM == FIRAT_SIGNAL_FROM_CROSSING
                                     : p->SIGNAL_FROM == SIGNAL_FROM_CROSSING;
    return from_crossing && m->state == PFSM_ENTER;
}
