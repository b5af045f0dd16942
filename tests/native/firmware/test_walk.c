#include "walk.h"

#include <stdlib.h>

#include "support.h"
#include "wire.h"

#define UNIT (PI / 32768)  // of an angle, in radians
#define STRAIGHT 153
#define WALL_IGNORE 400
#define FOOT_BOT_TURN 1398101  // a foot-bot's 0.70 s
#define SAMPLES 200000

typedef struct {
    walk_t walk;
    params_t params;
    random_t random;
    uint32_t now;
    uint32_t turned_away_ticks;
    uint8_t flags;
    bool legs;
} walker_t;

// Walking since `now`, and its first step done.
static walker_t walker(uint32_t now) {
    walker_t w = {.now = now, .legs = true};
    params_reset(&w.params);
    w.params.STRAIGHT_TICKS = STRAIGHT;
    w.params.WALL_IGNORE_TICKS = WALL_IGNORE;
    w.params.TURN_TICKS_PER_RAD = FOOT_BOT_TURN;
    random_seed(&w.random, 1, 1);
    walk_init(&w.walk, now);
    walk_straight(&w.walk, &w.params, now);
    walk_step(&w.walk, &w.params, &w.random, now, 0, true);
    return w;
}

static void step(walker_t *w) {
    w->now++;
    w->turned_away_ticks = walk_step(&w->walk, &w->params, &w->random, w->now, w->flags, w->legs);
}

static bool is_turning(const walker_t *w) {
    return w->walk.motion == WALK_LEFT || w->walk.motion == WALK_RIGHT;
}

// Steps until the motion is no longer `motion`; how many steps that took.
static uint32_t steps_while(walker_t *w, uint8_t motion) {
    for (uint32_t steps = 0; steps < 1000; steps++) {
        if (w->walk.motion != motion) return steps;
        step(w);
    }
    fail_msg("the motion never changed");
    return 0;
}

static double exact_cauchy_angle(uint32_t draw, double rho) {
    const double x = PI / 2 * ((draw >> 16) + 0.5) / 65536;
    const double angle = 2 * atan((1 - rho) / (1 + rho) * tan(x));
    return draw & 1 ? -angle : angle;
}

static double worst_cauchy_error(uint16_t rho_q16) {
    double worst = 0;
    for (uint32_t u = 0; u < 65536; u++) {
        for (uint32_t sign = 0; sign < 2; sign++) {
            const uint32_t draw = u << 16 | sign;
            const double angle = walk_angle_cauchy(draw, rho_q16) * UNIT;
            worst = fmax(worst, fabs(angle - exact_cauchy_angle(draw, rho_q16 / 65536.0)));
        }
    }
    return worst * 180 / PI;
}

TEST(cauchy_angles_are_within_a_tenth_of_a_degree_of_the_exact_inverse) {
    const double rhos[] = {0, 0.1, 0.25, 0.5, 0.6, 0.75, 0.9, 0.95, 0.99};
    for (size_t i = 0; i < sizeof rhos / sizeof *rhos; i++) {
        const double worst = worst_cauchy_error((uint16_t)(rhos[i] * 65536));
        if (worst >= 0.1) fail_msg("rho %.2f: %.3f degrees off", rhos[i], worst);
    }
}

TEST(cauchy_angles_stay_sound_up_to_the_largest_rho) {
    int16_t before = 0;
    for (uint32_t u = 0; u < 65536; u++) {
        const int16_t angle = walk_angle_cauchy(u << 16, 65535);
        assert_true(angle >= before);
        before = angle;
    }
    assert_int_equal(walk_angle_cauchy(0, 65535), 0);
    assert_true(before > 10923);  // even then one draw in 65,536 is 60 degrees and more
}

static int by_size(const void *a, const void *b) {
    const double difference = *(const double *)a - *(const double *)b;
    return (difference > 0) - (difference < 0);
}

// Kolmogorov and Smirnov: the largest gap between the sample and its distribution, times sqrt(n).
// It exceeds 2.2 once in 8,000 right programs.
static double gap(double *cumulative) {
    qsort(cumulative, SAMPLES, sizeof *cumulative, by_size);
    double largest = 0;
    for (int i = 0; i < SAMPLES; i++) {
        largest = fmax(largest, fabs(cumulative[i] - (i + 0.5) / SAMPLES));
    }
    return largest * sqrt(SAMPLES);
}

TEST(cauchy_angles_follow_the_wrapped_cauchy_distribution) {
    static double cumulative[SAMPLES];
    const double rhos[] = {0, 0.25, 0.5, 0.75, 0.95};
    for (size_t i = 0; i < sizeof rhos / sizeof *rhos; i++) {
        const double rho = rhos[i];
        random_t random;
        random_seed(&random, 1234, (uint16_t)i);
        for (int n = 0; n < SAMPLES; n++) {
            const uint16_t rho_q16 = (uint16_t)(rho * 65536);
            const double angle = walk_angle_cauchy(random_next(&random), rho_q16) * UNIT;
            cumulative[n] = 0.5 + atan((1 + rho) / (1 - rho) * tan(angle / 2)) / PI;
        }
        const double distance = gap(cumulative);
        if (distance > 2.2) fail_msg("rho %.2f: gap %.2f", rho, distance);
    }
}

TEST(uniform_angles_are_uniform_from_minus_pi_to_pi) {
    static double cumulative[SAMPLES];
    random_t random;
    random_seed(&random, 99, 0);
    for (int n = 0; n < SAMPLES; n++) {
        cumulative[n] = walk_angle_uniform(random_next(&random)) / 65536.0 + 0.5;
    }
    assert_true(gap(cumulative) < 2.2);
    assert_int_equal(walk_angle_uniform(0), 0);
    assert_int_equal(walk_angle_uniform(0x7FFFFFFF), INT16_MAX);
    assert_int_equal(walk_angle_uniform(0x80000000), INT16_MIN);
}

TEST(a_turn_takes_as_long_as_its_angle_says_to_the_nearest_tick) {
    const uint32_t rates[] = {1, 32768, 65536, FOOT_BOT_TURN, 2540000, 0x7FFFFFFF, UINT32_MAX};
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++) {
        for (int32_t angle = -32768; angle <= 32767; angle += 13) {
            const double exact = abs(angle) * UNIT * rates[i] / 65536.0;
            const double ticks = walk_turn_ticks((int16_t)angle, rates[i]);
            // pi is taken as 25,736 / 8,192, which is 8 parts in a million short of exact.
            assert_true(fabs(ticks - exact) <= 0.5 + exact * 1e-5);
        }
    }
    assert_int_equal(walk_turn_ticks(INT16_MIN, FOOT_BOT_TURN), 67);
}

TEST(a_walker_goes_straight_for_a_leg_then_turns_then_goes_straight_again) {
    for (uint32_t start = 0; start < 3; start++) {
        walker_t w = walker(start - 1);  // over the wrap of the ticks, too
        assert_int_equal(steps_while(&w, WALK_STRAIGHT), STRAIGHT);
        assert_true(is_turning(&w));
        assert_false(w.walk.avoiding);
        const uint32_t turn_ticks = w.walk.turn_end - w.now;
        assert_int_equal(steps_while(&w, w.walk.motion), turn_ticks);
        assert_int_equal(w.walk.motion, WALK_STRAIGHT);
        assert_int_equal(steps_while(&w, WALK_STRAIGHT), STRAIGHT);
    }
}

TEST(random_turns_go_left_and_right_alike) {
    walker_t w = walker(0);
    uint32_t left = 0;
    uint32_t turns = 0;
    while (turns < 2000) {
        steps_while(&w, WALK_STRAIGHT);
        left += w.walk.motion == WALK_LEFT;
        turns++;
        steps_while(&w, w.walk.motion);
    }
    assert_binomial(left, turns, 0.5);
}

TEST(a_random_turn_too_small_for_a_tick_is_left_out) {
    walker_t w = walker(0);
    w.params.TURN_TICKS_PER_RAD = 1;
    for (int i = 0; i < 10 * STRAIGHT; i++) {
        step(&w);
        assert_int_equal(w.walk.motion, WALK_STRAIGHT);
    }
    assert_int_equal(w.walk.leg_end, 11 * STRAIGHT);
}

TEST(without_legs_a_walker_goes_straight_for_ever) {
    walker_t w = walker(0);
    w.legs = false;
    for (int i = 0; i < 10 * STRAIGHT; i++) {
        step(&w);
        assert_int_equal(w.walk.motion, WALK_STRAIGHT);
    }
}

TEST(an_obstacle_makes_the_walker_turn_at_once_and_again_until_the_way_is_free) {
    walker_t w = walker(0);
    w.flags = WIRE_CELL_OBSTACLE;
    step(&w);
    int turns = 0;
    for (int i = 0; i < 2000; i++) {
        assert_true(w.walk.avoiding);
        assert_int_not_equal(w.walk.motion, WALK_STRAIGHT);
        turns += w.turned_away_ticks > 0;
        step(&w);
    }
    assert_in_range(turns, 40, 90);  // half of 67 ticks each on average

    w.flags = 0;
    while (w.now < w.walk.turn_end) {
        assert_true(w.walk.avoiding);  // an obstacle gone does not cut a turn short
        step(&w);
    }
    assert_int_equal(w.walk.motion, WALK_STRAIGHT);
    assert_false(w.walk.avoiding);
}

TEST(turns_away_from_obstacles_are_uniform) {
    walker_t w = walker(0);
    w.flags = WIRE_CELL_OBSTACLE;
    uint32_t left = 0;
    uint32_t beyond_a_right_angle = 0;
    uint32_t turns = 0;
    while (turns < 4000) {
        step(&w);
        if (w.turned_away_ticks == 0) continue;
        turns++;
        left += w.walk.motion == WALK_LEFT;
        beyond_a_right_angle += w.turned_away_ticks > 33;
    }
    assert_binomial(left, turns, 0.5);
    assert_binomial(beyond_a_right_angle, turns, 0.5);
}

TEST(a_turn_away_too_small_for_a_tick_is_a_stop_of_one_tick) {
    walker_t w = walker(0);
    w.params.TURN_TICKS_PER_RAD = 1;
    w.flags = WIRE_CELL_OBSTACLE;
    for (int i = 0; i < 5; i++) {
        step(&w);
        assert_int_equal(w.walk.motion, WALK_STOP);
        assert_int_equal(w.turned_away_ticks, 1);
    }
    w.flags = 0;
    step(&w);
    assert_int_equal(w.walk.motion, WALK_STRAIGHT);
}

TEST(a_leg_interrupted_by_an_obstacle_is_resumed_and_not_shortened) {
    walker_t w = walker(0);
    for (int i = 0; i < 50; i++) step(&w);
    w.flags = WIRE_CELL_OBSTACLE;
    step(&w);
    assert_true(is_turning(&w));
    w.flags = 0;
    steps_while(&w, w.walk.motion);
    assert_int_equal(steps_while(&w, WALK_STRAIGHT), STRAIGHT - 51);
}

TEST(an_obstacle_is_not_seen_during_a_random_turn_but_at_its_end) {
    walker_t w = walker(0);
    steps_while(&w, WALK_STRAIGHT);
    w.flags = WIRE_CELL_OBSTACLE;
    while (w.now + 1 < w.walk.turn_end) {
        step(&w);
        assert_false(w.walk.avoiding);
    }
    step(&w);
    assert_true(w.walk.avoiding);
}

TEST(a_wall_cell_turns_the_walker_once_and_is_then_ignored_for_its_time) {
    walker_t w = walker(0);
    w.legs = false;
    w.flags = WIRE_CELL_WALL;
    step(&w);
    assert_true(w.walk.avoiding);
    assert_true(is_turning(&w));
    steps_while(&w, w.walk.motion);
    assert_int_equal(w.walk.motion, WALK_STRAIGHT);
    assert_int_equal(steps_while(&w, WALK_STRAIGHT), WALL_IGNORE);
    assert_true(w.walk.avoiding);
}

TEST(an_obstacle_is_heeded_while_a_wall_cell_is_not_and_does_not_prolong_that) {
    walker_t w = walker(0);
    w.flags = WIRE_CELL_WALL;
    step(&w);
    steps_while(&w, w.walk.motion);
    const uint32_t heeded_from = w.walk.wall_heeded_from;
    w.flags = WIRE_CELL_WALL | WIRE_CELL_OBSTACLE;
    step(&w);
    assert_true(w.walk.avoiding);
    assert_int_equal(w.walk.wall_heeded_from, heeded_from);
}

TEST(a_blocked_way_is_an_obstacle_or_a_heeded_wall_cell) {
    walker_t w = walker(100);
    assert_false(walk_blocked(&w.walk, 100, 0));
    assert_true(walk_blocked(&w.walk, 100, WIRE_CELL_OBSTACLE));
    assert_true(walk_blocked(&w.walk, 100, WIRE_CELL_WALL));
    w.walk.wall_heeded_from = 101;
    assert_false(walk_blocked(&w.walk, 100, WIRE_CELL_WALL));
    assert_true(walk_blocked(&w.walk, 101, WIRE_CELL_WALL));
}

TEST(stopping_ends_everything_and_straight_breaks_off_a_turn) {
    walker_t w = walker(0);
    w.flags = WIRE_CELL_OBSTACLE;
    step(&w);
    walk_stop(&w.walk);
    assert_int_equal(w.walk.motion, WALK_STOP);
    assert_false(w.walk.avoiding);

    step(&w);
    walk_straight(&w.walk, &w.params, w.now);
    assert_int_equal(w.walk.motion, WALK_STRAIGHT);
    assert_false(w.walk.avoiding);
    assert_int_equal(w.walk.leg_end, w.now + STRAIGHT);
}

TEST(a_late_step_ends_what_is_over_and_does_no_harm) {
    walker_t w = walker(0);
    w.now += 10 * STRAIGHT;
    step(&w);
    assert_true(is_turning(&w));
    w.now += 1000;
    step(&w);
    assert_true(is_turning(&w));  // straight, and the leg is over as well
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cauchy_angles_are_within_a_tenth_of_a_degree_of_the_exact_inverse),
        cmocka_unit_test(cauchy_angles_stay_sound_up_to_the_largest_rho),
        cmocka_unit_test(cauchy_angles_follow_the_wrapped_cauchy_distribution),
        cmocka_unit_test(uniform_angles_are_uniform_from_minus_pi_to_pi),
        cmocka_unit_test(a_turn_takes_as_long_as_its_angle_says_to_the_nearest_tick),
        cmocka_unit_test(a_walker_goes_straight_for_a_leg_then_turns_then_goes_straight_again),
        cmocka_unit_test(random_turns_go_left_and_right_alike),
        cmocka_unit_test(a_random_turn_too_small_for_a_tick_is_left_out),
        cmocka_unit_test(without_legs_a_walker_goes_straight_for_ever),
        cmocka_unit_test(an_obstacle_makes_the_walker_turn_at_once_and_again_until_the_way_is_free),
        cmocka_unit_test(turns_away_from_obstacles_are_uniform),
        cmocka_unit_test(a_turn_away_too_small_for_a_tick_is_a_stop_of_one_tick),
        cmocka_unit_test(a_leg_interrupted_by_an_obstacle_is_resumed_and_not_shortened),
        cmocka_unit_test(an_obstacle_is_not_seen_during_a_random_turn_but_at_its_end),
        cmocka_unit_test(a_wall_cell_turns_the_walker_once_and_is_then_ignored_for_its_time),
        cmocka_unit_test(an_obstacle_is_heeded_while_a_wall_cell_is_not_and_does_not_prolong_that),
        cmocka_unit_test(a_blocked_way_is_an_obstacle_or_a_heeded_wall_cell),
        cmocka_unit_test(stopping_ends_everything_and_straight_breaks_off_a_turn),
        cmocka_unit_test(a_late_step_ends_what_is_over_and_does_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
