#include "pfsm.h"

#include <stdlib.h>
#include <string.h>

#include "pfsm_robot.h"
#include "support.h"
#include "wire.h"

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
    r.params.BETA = UINT32_MAX;  // one neighbour at all keeps the robot
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
        if (i % 3 == 0) hear(&r, 3);  // two empty windows, and a robot is received again
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
    r.params.PUSHED_OFF = PUSHED_OFF_STAY;
    start_and_rest(&r, BLACK);
    stand_on(&r, 0);
    assert_int_equal(r.machine.state, PFSM_REST);
    ticks(&r, STEP - 1);
    assert_int_equal(r.machine.state, PFSM_WALK);
}

TEST(without_config_a_robot_pushed_off_walks_at_once_informed_or_not) {
    for (uint8_t informed = 0; informed <= BLACK; informed += BLACK) {
        robot_t r = simplified();
        assert_int_equal(r.params.PUSHED_OFF, PUSHED_OFF_WALK);
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
    r.params.PUSHED_OFF = PUSHED_OFF_STAY;
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

int main(void) {
    const struct CMUnitTest tests[] = {
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
        cmocka_unit_test(without_config_a_robot_pushed_off_walks_at_once_informed_or_not),
        cmocka_unit_test(pushed_off_walk_lets_be_who_walked_out_and_rests),
        cmocka_unit_test(a_resting_robot_pushed_off_and_on_again_rests_on),
        cmocka_unit_test(firats_robot_walks_over_a_site_on_which_it_hears_nobody),
        cmocka_unit_test(an_informed_robot_of_firats_joins_though_it_hears_nobody),
        cmocka_unit_test(firat_join_crossing_listens_at_the_edge_only),
        cmocka_unit_test(firat_join_first_update_listens_one_period_after_the_edge_only),
        cmocka_unit_test(firat_join_first_update_by_the_common_clock_is_the_next_multiple),
        cmocka_unit_test(firat_join_every_update_listens_again_and_again),
        cmocka_unit_test(a_join_test_is_off_once_the_robot_is_off_the_site),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
