#include "pfsm.h"

#include <stdlib.h>
#include <string.h>

#include "exponential.h"
#include "leave.h"
#include "support.h"
#include "wire.h"

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

static void boot(robot_t *r, uint32_t now) {
    r->now = now;
    r->floor = (pfsm_floor_t){0, PFSM_FLOOR_UNKNOWN};
    neighbours_init(&r->neighbours, 100, 76);
    pfsm_init(&r->machine, &r->params, now, 1, 1);
}

// Parameters only: boot() comes after a test has set its own.
static robot_t simplified(void) {
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

static robot_t firat(void) {
    robot_t r = simplified();
    r.params.RULE = RULE_FIRAT;
    return r;
}

static bool step(robot_t *r) {
    return pfsm_step(&r->machine, &r->params, &r->neighbours, r->now, r->floor);
}

// To the end of this tick and the next one's step.
static void tick(robot_t *r) {
    r->now++;
    step(r);
}

static void ticks(robot_t *r, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) tick(r);
}

static void stand_on(robot_t *r, uint8_t site) {
    r->floor = (pfsm_floor_t){site, 0};
    tick(r);
}

static void hear(robot_t *r, uint8_t count) {
    for (uint8_t i = 0; i < count; i++) neighbours_heard(&r->neighbours, (uint16_t)(i + 2), r->now);
}

// Booted on the grey floor, a tick ago.
static void start(robot_t *r) {
    boot(r, 1000);
    stand_on(r, 0);
}

// Started, came onto the site, and rests there since this very tick.
static void start_and_rest(robot_t *r, uint8_t site) {
    start(r);
    stand_on(r, site);
    ticks(r, ENTRY);
    assert_int_equal(r->machine.state, PFSM_REST);
}

// Ticks until the state is no longer `state`, hearing `heard` robots all the time.
static uint32_t ticks_in(robot_t *r, uint8_t state, uint8_t heard) {
    for (uint32_t count = 0; count < 5000; count++) {
        if (r->machine.state != state) return count;
        r->now++;
        hear(r, heard);
        step(r);
    }
    return UINT32_MAX;
}

// A robot that leaves at its first test tells when that was.
static robot_t leaves_at_once(void) {
    robot_t r = simplified();
    r.params.ALPHA = UINT32_MAX;
    r.params.BETA = 0;
    return r;
}

// --- Walking and coming onto a site

TEST(a_robot_starts_walking_straight_on) {
    robot_t r = simplified();
    boot(&r, 1000);
    assert_true(step(&r));
    assert_int_equal(r.machine.state, PFSM_WALK);
    assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
    ticks(&r, STRAIGHT - 1);
    assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
    tick(&r);
    assert_int_not_equal(r.machine.walk.motion, WALK_STRAIGHT);
}

TEST(coming_onto_a_site_starts_the_entry_walk_and_then_rest) {
    robot_t r = simplified();
    start(&r);
    stand_on(&r, WHITE);
    assert_int_equal(r.machine.state, PFSM_ENTER);
    for (int i = 0; i < ENTRY - 1; i++) {
        tick(&r);
        assert_int_equal(r.machine.state, PFSM_ENTER);
        assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
    }
    tick(&r);
    assert_int_equal(r.machine.state, PFSM_REST);
    assert_int_equal(r.machine.walk.motion, WALK_STOP);
}

TEST(an_entry_walk_of_no_time_means_rest_at_the_edge) {
    robot_t r = simplified();
    r.params.ENTRY_TICKS = 0;
    start(&r);
    stand_on(&r, WHITE);
    assert_int_equal(r.machine.state, PFSM_REST);
}

TEST(coming_onto_a_site_breaks_off_a_turn) {
    robot_t r = simplified();
    start(&r);
    while (r.machine.walk.motion == WALK_STRAIGHT) tick(&r);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
}

TEST(a_robot_that_left_a_site_enters_it_again_only_at_a_new_edge) {
    robot_t r = leaves_at_once();
    start_and_rest(&r, BLACK);
    ticks(&r, STEP);
    assert_int_equal(r.machine.state, PFSM_LEAVE);
    stand_on(&r, 0);
    assert_int_equal(r.machine.state, PFSM_WALK);
    ticks(&r, 100);
    assert_int_equal(r.machine.state, PFSM_WALK);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_ENTER);
}

TEST(the_floor_holds_as_long_as_nothing_else_is_heard) {
    robot_t r = simplified();
    r.params.ALPHA = 0;
    start_and_rest(&r, BLACK);
    ticks(&r, 100000);
    assert_int_equal(r.machine.state, PFSM_REST);
}

TEST(before_the_first_cell_a_robot_walks_and_heeds_nothing) {
    robot_t r = simplified();
    boot(&r, 1000);
    for (int i = 0; i < 10000; i++) {
        tick(&r);
        assert_int_equal(r.machine.state, PFSM_WALK);
        assert_false(r.machine.walk.avoiding);
    }
}

TEST(start_on_site_entered_lets_the_first_cell_count_as_an_edge) {
    robot_t r = simplified();
    r.params.START_ON_SITE = START_ON_SITE_ENTERED;
    boot(&r, 1000);
    ticks(&r, 10);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_ENTER);
}

TEST(start_on_site_must_leave_asks_the_robot_to_get_off_first) {
    robot_t r = simplified();
    r.params.START_ON_SITE = START_ON_SITE_MUST_LEAVE;
    boot(&r, 1000);
    ticks(&r, 10);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_WALK);
    ticks(&r, 100);
    assert_int_equal(r.machine.state, PFSM_WALK);
    stand_on(&r, 0);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_ENTER);
}

TEST(start_on_site_must_leave_is_over_after_a_first_cell_off_site) {
    robot_t r = simplified();
    r.params.START_ON_SITE = START_ON_SITE_MUST_LEAVE;
    start(&r);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_ENTER);
}

// --- Informed robots

TEST(an_informed_robot_walks_over_another_site_as_if_it_were_grey) {
    robot_t informed = simplified();
    informed.params.INFORMED_SITE = BLACK;
    robot_t on_grey = informed;
    start(&informed);
    start(&on_grey);
    informed.floor.site = WHITE;
    for (int i = 0; i < 2000; i++) {
        tick(&informed);
        tick(&on_grey);
        assert_int_equal(informed.machine.state, PFSM_WALK);
        assert_int_equal(informed.machine.walk.motion, on_grey.machine.walk.motion);
    }
}

TEST(an_informed_robot_rests_on_its_own_site_and_never_leaves_it) {
    for (uint8_t rule = RULE_SIMPLIFIED; rule <= RULE_FIRAT; rule++) {
        robot_t r = leaves_at_once();
        r.params.RULE = rule;
        r.params.INFORMED_SITE = BLACK;
        r.params.SIGNAL_FROM = SIGNAL_FROM_CROSSING;
        start_and_rest(&r, BLACK);
        ticks(&r, 100000);
        assert_int_equal(r.machine.state, PFSM_REST);
    }
}

TEST(an_informed_robot_comes_from_the_other_site_straight_onto_its_own) {
    robot_t r = simplified();
    r.params.INFORMED_SITE = BLACK;
    start(&r);
    stand_on(&r, WHITE);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_ENTER);
}

// --- The entry walk

static robot_t entering(uint8_t entry_obstacle) {
    robot_t r = simplified();
    r.params.ALPHA = 0;
    r.params.ENTRY_OBSTACLE = entry_obstacle;
    start(&r);
    stand_on(&r, BLACK);
    return r;
}

TEST(entry_obstacle_turn_turns_away_while_the_time_runs) {
    robot_t r = entering(ENTRY_OBSTACLE_TURN);
    r.floor.flags = WIRE_CELL_OBSTACLE;
    tick(&r);
    assert_int_equal(r.machine.state, PFSM_ENTER);
    assert_true(r.machine.walk.avoiding);
    assert_int_equal(ticks_in(&r, PFSM_ENTER, 0), ENTRY - 1);
    assert_int_equal(r.machine.state, PFSM_REST);
    assert_false(r.machine.walk.avoiding);
}

TEST(entry_obstacle_rest_rests_at_once) {
    robot_t r = entering(ENTRY_OBSTACLE_REST);
    ticks(&r, 10);
    r.floor.flags = WIRE_CELL_OBSTACLE;
    tick(&r);
    assert_int_equal(r.machine.state, PFSM_REST);
}

TEST(entry_obstacle_rest_rests_at_the_edge_if_the_way_is_blocked_there) {
    robot_t r = simplified();
    r.params.ENTRY_OBSTACLE = ENTRY_OBSTACLE_REST;
    start(&r);
    r.floor = (pfsm_floor_t){BLACK, WIRE_CELL_OBSTACLE};
    tick(&r);
    assert_int_equal(r.machine.state, PFSM_REST);
}

TEST(entry_obstacle_pause_stops_the_time_during_turns) {
    robot_t r = entering(ENTRY_OBSTACLE_PAUSE);
    ticks(&r, 10);
    r.floor.flags = WIRE_CELL_OBSTACLE;
    ticks(&r, 200);
    r.floor.flags = 0;
    uint32_t straight = 11;  // the tick in which it met the obstacle was still straight
    while (r.machine.state == PFSM_ENTER) {
        straight += r.machine.walk.motion == WALK_STRAIGHT;
        tick(&r);
    }
    assert_int_equal(straight, ENTRY);
    assert_true(r.now > 1002 + ENTRY + 190);
}

TEST(walk_out_walk_goes_back_to_walking_with_a_fresh_leg) {
    robot_t r = entering(ENTRY_OBSTACLE_TURN);
    ticks(&r, 100);
    stand_on(&r, 0);
    assert_int_equal(r.machine.state, PFSM_WALK);
    ticks(&r, STRAIGHT - 1);
    assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
    tick(&r);
    assert_int_not_equal(r.machine.walk.motion, WALK_STRAIGHT);
}

TEST(walk_out_rest_rests_where_it_is) {
    robot_t r = simplified();
    r.params.WALK_OUT = WALK_OUT_REST;
    start(&r);
    stand_on(&r, BLACK);
    ticks(&r, 100);
    stand_on(&r, 0);
    assert_int_equal(r.machine.state, PFSM_REST);
    assert_true(pfsm_signals(&r.machine, &r.params));
}

TEST(walking_out_onto_another_site_enters_that_one) {
    robot_t r = entering(ENTRY_OBSTACLE_TURN);
    ticks(&r, 100);
    stand_on(&r, WHITE);
    assert_int_equal(r.machine.state, PFSM_ENTER);
    assert_int_equal(r.machine.home, WHITE);
    assert_int_equal(ticks_in(&r, PFSM_ENTER, 0), ENTRY);
}

// --- Leave tests: when

TEST(first_leave_next_step_tests_one_step_after_coming_to_rest) {
    robot_t r = leaves_at_once();
    start_and_rest(&r, BLACK);
    assert_int_equal(ticks_in(&r, PFSM_REST, 0), STEP);
}

TEST(first_leave_full_period_tests_one_period_after_coming_to_rest) {
    robot_t r = leaves_at_once();
    r.params.FIRST_LEAVE = FIRST_LEAVE_FULL_PERIOD;
    start_and_rest(&r, BLACK);
    assert_int_equal(ticks_in(&r, PFSM_REST, 0), UPDATE);
}

TEST(after_the_first_test_there_is_one_in_each_period) {
    robot_t r = simplified();
    r.params.ALPHA = 0;
    start_and_rest(&r, BLACK);
    uint32_t expected = r.now + STEP;
    for (int i = 0; i < 20 * UPDATE; i++) {
        const random_t before = r.machine.random;
        tick(&r);
        const bool tested = memcmp(&before, &r.machine.random, sizeof before) != 0;
        assert_int_equal(tested, r.now == expected);
        if (tested) expected += UPDATE;
    }
}

TEST(tests_missed_in_a_pause_are_not_made_up_for) {
    for (uint8_t clock = UPDATE_CLOCK_OWN; clock <= UPDATE_CLOCK_COMMON; clock++) {
        robot_t r = simplified();
        r.params.ALPHA = 0;
        r.params.UPDATE_CLOCK = clock;
        start_and_rest(&r, BLACK);
        r.now += 100 * UPDATE;
        step(&r);
        assert_in_range(r.machine.test_at, r.now + 1, r.now + UPDATE);
    }
}

TEST(the_common_clock_puts_tests_off_to_multiples_of_the_period_since_the_start) {
    for (uint32_t lag = 0; lag < UPDATE; lag++) {
        for (uint8_t first = FIRST_LEAVE_NEXT_STEP; first <= FIRST_LEAVE_FULL_PERIOD; first++) {
            robot_t r = leaves_at_once();
            r.params.UPDATE_CLOCK = UPDATE_CLOCK_COMMON;
            r.params.FIRST_LEAVE = first;
            boot(&r, UINT32_MAX - 10);
            const uint32_t origin = r.now;
            stand_on(&r, 0);
            ticks(&r, lag);
            stand_on(&r, BLACK);
            ticks(&r, ENTRY);
            const uint32_t earliest =
                r.now - origin + (first == FIRST_LEAVE_NEXT_STEP ? STEP : UPDATE);
            ticks_in(&r, PFSM_REST, 0);
            assert_int_equal((r.now - origin) % UPDATE, 0);
            assert_in_range(r.now - origin, earliest, earliest + UPDATE - 1);
        }
    }
}

TEST(signal_from_crossing_tests_in_the_entry_walk_too) {
    robot_t r = leaves_at_once();
    r.params.SIGNAL_FROM = SIGNAL_FROM_CROSSING;
    start(&r);
    stand_on(&r, BLACK);
    assert_int_equal(ticks_in(&r, PFSM_ENTER, 0), STEP);
    assert_int_equal(r.machine.state, PFSM_LEAVE);

    r.params.FIRST_LEAVE = FIRST_LEAVE_FULL_PERIOD;
    start(&r);
    stand_on(&r, BLACK);
    assert_int_equal(ticks_in(&r, PFSM_ENTER, 0), UPDATE);
    assert_int_equal(r.machine.state, PFSM_LEAVE);
}

TEST(signal_from_crossing_keeps_the_clock_when_coming_to_rest) {
    robot_t r = simplified();
    r.params.SIGNAL_FROM = SIGNAL_FROM_CROSSING;
    r.params.ALPHA = 0;
    start(&r);
    stand_on(&r, BLACK);
    const uint32_t edge = r.now;
    ticks(&r, ENTRY);
    assert_int_equal(r.machine.state, PFSM_REST);
    assert_int_equal((r.machine.test_at - edge - STEP) % UPDATE, 0);
    assert_in_range(r.machine.test_at, r.now, r.now + UPDATE);
}

// --- Leave tests: with what probability

// Leaves at tests of a robot that hears `n` others; every leaver is put back.
static void assert_leaves_with(robot_t *r, uint8_t n, uint32_t tests, double p) {
    pfsm_t resting = r->machine;
    resting.wake = resting.test_at;
    uint32_t left = 0;
    for (uint32_t i = 0; i < tests; i++) {
        const random_t luck = r->machine.random;
        r->machine = resting;
        r->machine.random = luck;
        r->now = resting.test_at;
        neighbours_init(&r->neighbours, 100, 76);
        hear(r, n);
        step(r);
        left += r->machine.state == PFSM_LEAVE;
    }
    assert_binomial(left, tests, p);
}

TEST(the_simplified_rule_leaves_as_often_as_it_says) {
    const uint8_t crowds[] = {0, 1, 2, 3, 5, 20, 100};
    for (size_t i = 0; i < sizeof crowds; i++) {
        robot_t r = simplified();
        start_and_rest(&r, BLACK);
        assert_leaves_with(&r, crowds[i], 50000, 0.5 * exp(-2.25 * crowds[i]));
    }
}

TEST(the_simplified_rule_takes_any_alpha_and_beta) {
    const double alphas[] = {0, 0.25, 1, 3};
    const double betas[] = {0, 0.1, 0.5, 1.5};
    for (int i = 0; i < 16; i++) {
        robot_t r = simplified();
        const double alpha = alphas[i / 4];
        const double beta = betas[i % 4];
        r.params.ALPHA = (uint32_t)(alpha * 65536);
        r.params.BETA = (uint32_t)(beta * 65536);
        start_and_rest(&r, BLACK);
        assert_leaves_with(&r, 2, 20000, fmin(1, alpha * exp(-beta * 2)));
    }
}

TEST(count_self_adds_one_robot) {
    robot_t r = simplified();
    r.params.COUNT_SELF = 1;
    start_and_rest(&r, BLACK);
    assert_leaves_with(&r, 0, 50000, 0.5 * exp(-2.25));
    assert_leaves_with(&r, 1, 50000, 0.5 * exp(-4.5));
}

// The generator's first output is the sum of a, b and counter.
static bool leaves_at_draw(uint32_t draw, uint32_t alpha) {
    robot_t r = simplified();
    r.params.ALPHA = alpha;
    start_and_rest(&r, BLACK);
    r.machine.random = (random_t){draw, 0, 0, 0};
    ticks(&r, STEP);
    return r.machine.state == PFSM_LEAVE;
}

TEST(no_draw_makes_a_robot_leave_with_probability_zero_or_stay_with_one) {
    assert_false(leaves_at_draw(0, 0));
    assert_true(leaves_at_draw(UINT32_MAX, 65536));
    assert_true(leaves_at_draw(0x7FFFFFFF, 32768));
    assert_false(leaves_at_draw(0x80000000, 32768));
}

TEST(those_heard_before_the_window_do_not_count) {
    robot_t r = simplified();
    r.params.ALPHA = 65536;
    r.params.BETA = UINT32_MAX;  // anybody at all keeps the robot
    start_and_rest(&r, BLACK);
    hear(&r, 1);
    r.machine.test_at = r.now + WINDOW;
    ticks(&r, WINDOW);
    assert_int_equal(r.machine.state, PFSM_REST);
    r.machine.test_at = r.machine.wake = r.now + 1;
    tick(&r);
    assert_int_equal(r.machine.state, PFSM_LEAVE);
}

// A Firat robot that came to rest when it heard `x` informed ones.
static robot_t joined_with(uint8_t x, double a, double k) {
    robot_t r = firat();
    r.params.FIRAT_A = (uint32_t)(a * 65536);
    r.params.FIRAT_K = (uint32_t)(k * 65536);
    r.params.ENTRY_TICKS = 0;
    start(&r);
    hear(&r, x);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_REST);
    return r;
}

TEST(firats_rule_leaves_as_often_as_it_says) {
    const uint8_t heard[][2] = {{1, 1}, {1, 2}, {2, 1}, {1, 3}, {5, 1}, {4, 30}, {100, 97}, {9, 4}};
    for (size_t i = 0; i < sizeof heard / sizeof *heard; i++) {
        const uint8_t n = heard[i][0];
        const uint8_t x = heard[i][1];
        robot_t r = joined_with(x, 0.7, 4.5);
        const double p = fmin(1, exp(-0.7 * (4.5 - abs(n - x))));
        assert_leaves_with(&r, n, 50000, p);
    }
}

TEST(firats_rule_with_the_papers_values_holds_a_robot_for_good) {
    robot_t r = joined_with(3, 2, 18);
    assert_leaves_with(&r, 5, 50000, 0);
    assert_leaves_with(&r, 21, 1000, 1);
}

TEST(firats_robot_leaves_for_certain_when_it_hears_nobody) {
    robot_t r = joined_with(3, 2, 18);
    assert_leaves_with(&r, 0, 1000, 1);
}

TEST(firats_robot_believes_only_so_many_empty_windows_in_a_row) {
    robot_t r = joined_with(3, 2, 18);
    r.params.EMPTY_WINDOWS = 3;
    for (int i = 0; i < 10; i++) {
        assert_int_equal(r.machine.state, PFSM_REST);
        r.now = r.machine.test_at;
        if (i % 3 == 0) hear(&r, 3);  // two empty windows, and somebody is heard again
        step(&r);
    }
    for (int i = 0; i < 3; i++) {
        assert_int_equal(r.machine.state, PFSM_REST);
        r.now = r.machine.test_at;
        step(&r);
    }
    assert_int_equal(r.machine.state, PFSM_LEAVE);
}

TEST(empty_windows_of_an_earlier_stay_are_forgotten) {
    robot_t r = joined_with(3, 2, 18);
    r.params.EMPTY_WINDOWS = 2;
    r.params.WALK_OUT = WALK_OUT_REST;
    r.machine.empty_windows = 1;
    r.machine.state = PFSM_WALK;
    stand_on(&r, 0);
    hear(&r, 1);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.empty_windows, 0);
}

// --- Leaving

TEST(a_leaving_robot_goes_straight_until_it_is_off_the_site_then_walks_a_fresh_leg) {
    robot_t r = leaves_at_once();
    start_and_rest(&r, BLACK);
    ticks(&r, STEP);
    for (int i = 0; i < 1000; i++) {
        assert_int_equal(r.machine.state, PFSM_LEAVE);
        assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
        tick(&r);
    }
    stand_on(&r, 0);
    assert_int_equal(r.machine.state, PFSM_WALK);
    ticks(&r, STRAIGHT - 1);
    assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
    tick(&r);
    assert_int_not_equal(r.machine.walk.motion, WALK_STRAIGHT);
}

TEST(a_leaving_robot_avoids_obstacles) {
    robot_t r = leaves_at_once();
    start_and_rest(&r, BLACK);
    ticks(&r, STEP);
    r.floor.flags = WIRE_CELL_OBSTACLE;
    tick(&r);
    assert_int_equal(r.machine.state, PFSM_LEAVE);
    assert_true(r.machine.walk.avoiding);
}

TEST(with_leave_turn_a_leaving_robot_turns_after_each_leg) {
    robot_t r = leaves_at_once();
    r.params.LEAVE_TURN = 1;
    start_and_rest(&r, BLACK);
    ticks(&r, STEP);
    ticks(&r, STRAIGHT - 1);
    assert_int_equal(r.machine.walk.motion, WALK_STRAIGHT);
    tick(&r);
    assert_int_not_equal(r.machine.walk.motion, WALK_STRAIGHT);
    assert_int_equal(r.machine.state, PFSM_LEAVE);
}

TEST(a_robot_leaving_straight_onto_another_site_enters_that) {
    robot_t r = leaves_at_once();
    start_and_rest(&r, BLACK);
    ticks(&r, STEP);
    stand_on(&r, WHITE);
    assert_int_equal(r.machine.state, PFSM_ENTER);
}

TEST(a_robot_pushed_off_its_site_rests_on_and_walks_at_once_when_it_leaves) {
    robot_t r = leaves_at_once();
    start_and_rest(&r, BLACK);
    stand_on(&r, 0);
    assert_int_equal(r.machine.state, PFSM_REST);
    ticks(&r, STEP - 1);
    assert_int_equal(r.machine.state, PFSM_WALK);
}

TEST(pushed_off_walk_walks_at_once_informed_or_not) {
    for (uint8_t informed = 0; informed <= BLACK; informed += BLACK) {
        robot_t r = simplified();
        r.params.PUSHED_OFF = PUSHED_OFF_WALK;
        r.params.ALPHA = 0;
        r.params.INFORMED_SITE = informed;
        start_and_rest(&r, BLACK);
        stand_on(&r, 0);
        assert_int_equal(r.machine.state, PFSM_WALK);
        assert_false(pfsm_signals(&r.machine, &r.params));
        stand_on(&r, BLACK);
        assert_int_equal(r.machine.state, PFSM_ENTER);
    }
}

TEST(pushed_off_walk_lets_be_who_walked_out_and_rests) {
    robot_t r = simplified();
    r.params.PUSHED_OFF = PUSHED_OFF_WALK;
    r.params.WALK_OUT = WALK_OUT_REST;
    r.params.ALPHA = 0;
    start(&r);
    stand_on(&r, BLACK);
    ticks(&r, 100);
    stand_on(&r, 0);
    ticks(&r, 100);
    assert_int_equal(r.machine.state, PFSM_REST);
}

TEST(a_resting_robot_pushed_off_and_on_again_rests_on) {
    robot_t r = simplified();
    r.params.ALPHA = 0;
    start_and_rest(&r, BLACK);
    stand_on(&r, 0);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_REST);
}

// --- Firat's way of joining

TEST(firats_robot_walks_over_a_site_on_which_it_hears_nobody) {
    for (uint8_t join = FIRAT_JOIN_CROSSING; join <= FIRAT_JOIN_EVERY_UPDATE; join++) {
        robot_t r = firat();
        r.params.FIRAT_JOIN = join;
        start(&r);
        stand_on(&r, BLACK);
        ticks(&r, 20000);
        assert_int_equal(r.machine.state, PFSM_WALK);
    }
}

TEST(an_informed_robot_of_firats_joins_though_it_hears_nobody) {
    for (uint8_t join = FIRAT_JOIN_CROSSING; join <= FIRAT_JOIN_EVERY_UPDATE; join++) {
        robot_t r = firat();
        r.params.FIRAT_JOIN = join;
        r.params.INFORMED_SITE = BLACK;
        start(&r);
        stand_on(&r, BLACK);
        assert_int_equal(r.machine.state, PFSM_ENTER);
    }
}

TEST(firat_join_crossing_listens_at_the_edge_only) {
    robot_t r = firat();
    start(&r);
    hear(&r, 4);
    stand_on(&r, BLACK);
    assert_int_equal(r.machine.state, PFSM_ENTER);
    assert_int_equal(r.machine.joined_with, 4);

    start(&r);
    stand_on(&r, BLACK);
    assert_int_equal(ticks_in(&r, PFSM_WALK, 4), UINT32_MAX);
}

TEST(firat_join_first_update_listens_one_period_after_the_edge_only) {
    robot_t r = firat();
    r.params.FIRAT_JOIN = FIRAT_JOIN_FIRST_UPDATE;
    start(&r);
    stand_on(&r, BLACK);
    assert_int_equal(ticks_in(&r, PFSM_WALK, 4), UPDATE);
    assert_int_equal(r.machine.state, PFSM_ENTER);
    assert_int_equal(r.machine.joined_with, 4);

    start(&r);
    stand_on(&r, BLACK);
    ticks(&r, UPDATE);
    assert_int_equal(ticks_in(&r, PFSM_WALK, 4), UINT32_MAX);
}

TEST(firat_join_first_update_by_the_common_clock_is_the_next_multiple) {
    for (uint32_t lag = 0; lag < UPDATE; lag++) {
        robot_t r = firat();
        r.params.FIRAT_JOIN = FIRAT_JOIN_FIRST_UPDATE;
        r.params.UPDATE_CLOCK = UPDATE_CLOCK_COMMON;
        start(&r);
        ticks(&r, lag);
        stand_on(&r, BLACK);
        const uint32_t edge = r.now - 1000;
        assert_int_equal(ticks_in(&r, PFSM_WALK, 1), UPDATE - edge % UPDATE);
    }
}

TEST(firat_join_every_update_listens_again_and_again) {
    robot_t r = firat();
    r.params.FIRAT_JOIN = FIRAT_JOIN_EVERY_UPDATE;
    start(&r);
    stand_on(&r, BLACK);
    ticks(&r, 3 * UPDATE);
    assert_int_equal(ticks_in(&r, PFSM_WALK, 2), UPDATE);
    assert_int_equal(r.machine.joined_with, 2);
    assert_int_equal(ticks_in(&r, PFSM_ENTER, 2), ENTRY);  // the entry walk starts with joining
}

TEST(a_join_test_is_off_once_the_robot_is_off_the_site) {
    robot_t r = firat();
    r.params.FIRAT_JOIN = FIRAT_JOIN_EVERY_UPDATE;
    start(&r);
    stand_on(&r, BLACK);
    ticks(&r, UPDATE / 2);
    stand_on(&r, 0);
    assert_int_equal(ticks_in(&r, PFSM_WALK, 4), UINT32_MAX);
}

// --- Signals

// In walking, entering, resting, leaving: "_" silent, "S" signals.
static void assert_signals(robot_t *r, const char *expected) {
    for (uint8_t state = PFSM_WALK; state <= PFSM_LEAVE; state++) {
        r->machine.state = state;
        assert_int_equal(pfsm_signals(&r->machine, &r->params), expected[state] == 'S');
    }
}

TEST(by_the_simplified_rule_every_robot_signals_from_rest_or_from_the_crossing) {
    for (uint8_t informed = 0; informed <= 1; informed++) {
        robot_t r = simplified();
        r.params.INFORMED_SITE = informed;
        boot(&r, 0);
        assert_signals(&r, "__S_");
        r.params.SIGNAL_FROM = SIGNAL_FROM_CROSSING;
        assert_signals(&r, "_SS_");
    }
}

TEST(by_firats_rule_informed_robots_alone_signal_from_the_crossing_or_from_rest) {
    robot_t r = firat();
    boot(&r, 0);
    assert_signals(&r, "____");
    r.params.SIGNAL_FROM = SIGNAL_FROM_CROSSING;
    assert_signals(&r, "____");
    r.params.INFORMED_SITE = BLACK;
    assert_signals(&r, "_SS_");
    r.params.FIRAT_SIGNAL_FROM = FIRAT_SIGNAL_FROM_REST;
    assert_signals(&r, "__S_");
}

// --- Whole lives

static uint32_t below(random_t *random, uint32_t limit) { return random_next(random) % limit; }

// Any parameters in their ranges, those that are times short enough for much to happen.
static void draw_params(params_t *params, random_t *random) {
#define DRAW(name, key, preset, least, most) \
    if ((most) <= 2) params_set(params, key, below(random, (most) + 1u));
    WIRE_CONFIG_KEYS(DRAW)
    params_set(params, WIRE_KEY_BETA, below(random, 65536));
    params_set(params, WIRE_KEY_FIRAT_A, below(random, 65536));
    params_set(params, WIRE_KEY_FIRAT_K, below(random, 4 * 65536));
    params_set(params, WIRE_KEY_ENTRY_TICKS, below(random, 60));
    params_set(params, WIRE_KEY_STRAIGHT_TICKS, 1 + below(random, 60));
    params_set(params, WIRE_KEY_WALL_IGNORE_TICKS, below(random, 60));
    params_set(params, WIRE_KEY_INFORMED_SITE, below(random, 3) == 0);
    params_set(params, WIRE_KEY_EMPTY_WINDOWS, 1 + below(random, 3));
}

// A world that makes no sense, but one in which everything happens.
static void draw_world(robot_t *r, random_t *world) {
    if (below(world, 40) == 0) r->floor.site = (uint8_t)below(world, 3);
    if (below(world, 10) == 0) r->floor.flags = (uint8_t)(below(world, 4) * (below(world, 3) == 0));
    if (below(world, 10) == 0) hear(r, (uint8_t)below(world, 10));
}

TEST(skipping_ticks_in_which_nothing_happens_changes_nothing) {
    random_t world;
    random_seed(&world, 77, 0);
    for (int life = 0; life < 300; life++) {
        robot_t lazy = simplified();
        draw_params(&lazy.params, &world);
        boot(&lazy, UINT32_MAX - 500);
        robot_t eager = lazy;
        for (int i = 0; i < 1500; i++) {
            draw_world(&lazy, &world);
            eager.floor = lazy.floor;
            eager.neighbours = lazy.neighbours;
            eager.machine.wake = ++eager.now;
            lazy.now++;
            assert_true(step(&eager));
            const bool stepped = step(&lazy);
            if (!stepped) assert_true((int32_t)(lazy.machine.wake - lazy.now) > 0);

            assert_int_equal(lazy.machine.state, eager.machine.state);
            assert_memory_equal(&lazy.machine.walk, &eager.machine.walk, sizeof(walk_t));
            assert_memory_equal(&lazy.machine.random, &eager.machine.random, sizeof(random_t));
        }
    }
}

TEST(most_ticks_take_the_short_way) {
    robot_t r = simplified();
    start_and_rest(&r, BLACK);
    r.params.ALPHA = 0;
    uint32_t steps = 0;
    for (int i = 0; i < 100 * UPDATE; i++) {
        r.now++;
        steps += step(&r);
    }
    assert_int_equal(steps, 100);
}

// FNV-1a of what 200 robots do in 2,000 ticks. A number other than this one on any machine, with
// any compiler and at any level means that robots there behave differently.
TEST(the_same_inputs_give_the_same_lives_on_every_machine) {
    uint64_t hash = UINT64_C(0xCBF29CE484222325);
    random_t world;
    random_seed(&world, 2022, 0);
    for (uint32_t life = 0; life < 200; life++) {
        robot_t r = simplified();
        draw_params(&r.params, &world);
        boot(&r, life * 1000);
        for (int i = 0; i < 2000; i++) {
            draw_world(&r, &world);
            tick(&r);
            const uint8_t shown[] = {r.machine.state, r.machine.walk.motion,
                                     r.machine.walk.avoiding, pfsm_signals(&r.machine, &r.params)};
            for (size_t b = 0; b < sizeof shown; b++) {
                hash = (hash ^ shown[b]) * UINT64_C(0x100000001B3);
            }
        }
    }
    assert_int_equal(hash, UINT64_C(0x9378B4397DD820D5));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_robot_starts_walking_straight_on),
        cmocka_unit_test(coming_onto_a_site_starts_the_entry_walk_and_then_rest),
        cmocka_unit_test(an_entry_walk_of_no_time_means_rest_at_the_edge),
        cmocka_unit_test(coming_onto_a_site_breaks_off_a_turn),
        cmocka_unit_test(a_robot_that_left_a_site_enters_it_again_only_at_a_new_edge),
        cmocka_unit_test(the_floor_holds_as_long_as_nothing_else_is_heard),
        cmocka_unit_test(before_the_first_cell_a_robot_walks_and_heeds_nothing),
        cmocka_unit_test(start_on_site_entered_lets_the_first_cell_count_as_an_edge),
        cmocka_unit_test(start_on_site_must_leave_asks_the_robot_to_get_off_first),
        cmocka_unit_test(start_on_site_must_leave_is_over_after_a_first_cell_off_site),
        cmocka_unit_test(an_informed_robot_walks_over_another_site_as_if_it_were_grey),
        cmocka_unit_test(an_informed_robot_rests_on_its_own_site_and_never_leaves_it),
        cmocka_unit_test(an_informed_robot_comes_from_the_other_site_straight_onto_its_own),
        cmocka_unit_test(entry_obstacle_turn_turns_away_while_the_time_runs),
        cmocka_unit_test(entry_obstacle_rest_rests_at_once),
        cmocka_unit_test(entry_obstacle_rest_rests_at_the_edge_if_the_way_is_blocked_there),
        cmocka_unit_test(entry_obstacle_pause_stops_the_time_during_turns),
        cmocka_unit_test(walk_out_walk_goes_back_to_walking_with_a_fresh_leg),
        cmocka_unit_test(walk_out_rest_rests_where_it_is),
        cmocka_unit_test(walking_out_onto_another_site_enters_that_one),
        cmocka_unit_test(first_leave_next_step_tests_one_step_after_coming_to_rest),
        cmocka_unit_test(first_leave_full_period_tests_one_period_after_coming_to_rest),
        cmocka_unit_test(after_the_first_test_there_is_one_in_each_period),
        cmocka_unit_test(tests_missed_in_a_pause_are_not_made_up_for),
        cmocka_unit_test(
            the_common_clock_puts_tests_off_to_multiples_of_the_period_since_the_start),
        cmocka_unit_test(signal_from_crossing_tests_in_the_entry_walk_too),
        cmocka_unit_test(signal_from_crossing_keeps_the_clock_when_coming_to_rest),
        cmocka_unit_test(the_simplified_rule_leaves_as_often_as_it_says),
        cmocka_unit_test(the_simplified_rule_takes_any_alpha_and_beta),
        cmocka_unit_test(count_self_adds_one_robot),
        cmocka_unit_test(no_draw_makes_a_robot_leave_with_probability_zero_or_stay_with_one),
        cmocka_unit_test(those_heard_before_the_window_do_not_count),
        cmocka_unit_test(firats_rule_leaves_as_often_as_it_says),
        cmocka_unit_test(firats_rule_with_the_papers_values_holds_a_robot_for_good),
        cmocka_unit_test(firats_robot_leaves_for_certain_when_it_hears_nobody),
        cmocka_unit_test(firats_robot_believes_only_so_many_empty_windows_in_a_row),
        cmocka_unit_test(empty_windows_of_an_earlier_stay_are_forgotten),
        cmocka_unit_test(
            a_leaving_robot_goes_straight_until_it_is_off_the_site_then_walks_a_fresh_leg),
        cmocka_unit_test(a_leaving_robot_avoids_obstacles),
        cmocka_unit_test(with_leave_turn_a_leaving_robot_turns_after_each_leg),
        cmocka_unit_test(a_robot_leaving_straight_onto_another_site_enters_that),
        cmocka_unit_test(a_robot_pushed_off_its_site_rests_on_and_walks_at_once_when_it_leaves),
        cmocka_unit_test(pushed_off_walk_walks_at_once_informed_or_not),
        cmocka_unit_test(pushed_off_walk_lets_be_who_walked_out_and_rests),
        cmocka_unit_test(a_resting_robot_pushed_off_and_on_again_rests_on),
        cmocka_unit_test(firats_robot_walks_over_a_site_on_which_it_hears_nobody),
        cmocka_unit_test(an_informed_robot_of_firats_joins_though_it_hears_nobody),
        cmocka_unit_test(firat_join_crossing_listens_at_the_edge_only),
        cmocka_unit_test(firat_join_first_update_listens_one_period_after_the_edge_only),
        cmocka_unit_test(firat_join_first_update_by_the_common_clock_is_the_next_multiple),
        cmocka_unit_test(firat_join_every_update_listens_again_and_again),
        cmocka_unit_test(a_join_test_is_off_once_the_robot_is_off_the_site),
        cmocka_unit_test(by_the_simplified_rule_every_robot_signals_from_rest_or_from_the_crossing),
        cmocka_unit_test(
            by_firats_rule_informed_robots_alone_signal_from_the_crossing_or_from_rest),
        cmocka_unit_test(skipping_ticks_in_which_nothing_happens_changes_nothing),
        cmocka_unit_test(most_ticks_take_the_short_way),
        cmocka_unit_test(the_same_inputs_give_the_same_lives_on_every_machine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
