/// The libraries that Kilogrid robot programs stand on: walls, decisions, gradients; on a Kilobot
/// API that only remembers.
#include <kilob_cdms.h>
#include <kilob_gradient.h>
#include <kilob_wall_avoidance.h>

#include "fake_kilolib.h"
#include "support.h"

volatile uint8_t DDRB, DDRD;

static direction_t other(direction_t side) { return side == LEFT ? RIGHT : LEFT; }

// Walls

static void see_wall(int16_t high_gain) {
    distance_measurement_t distance = {0, high_gain};
    IR_message_t message = {.type = NORMAL};
    for (int i = 0; i < WALL_READINGS_BUFFER_SIZE; i++) kilob_on_wall_detected(&distance, &message);
}

static void meet_wall(void) {
    fake_reset();
    init_motors();
    kilo_ticks = 1000;
    kilob_wall_avoidance_init();
}

TEST(without_a_wall_the_robot_is_left_alone) {
    meet_wall();
    assert_int_equal(kilob_wall_avoidance(), 0);
    assert_int_equal(get_direction(), UNDEFINED);
}

TEST(a_robot_turns_from_a_wall_until_its_light_gets_weaker_then_goes_straight) {
    meet_wall();
    see_wall(500);
    assert_int_equal(kilob_wall_avoidance(), 1);
    const direction_t side = get_direction();
    assert_true(side == LEFT || side == RIGHT);
    see_wall(500);
    assert_int_equal(kilob_wall_avoidance(), 1);
    assert_int_equal(kilob_wall_avoidance(), 1);  // no new sum
    see_wall(600);
    assert_int_equal(kilob_wall_avoidance(), 1);
    assert_int_equal(get_direction(), side);
    see_wall(400);
    assert_int_equal(kilob_wall_avoidance(), 1);
    assert_int_equal(get_direction(), STRAIGHT);
    assert_int_equal(kilob_wall_avoidance(), 1);  // no new sum
    see_wall(400);
    assert_int_equal(kilob_wall_avoidance(), 1);
    assert_int_equal(get_direction(), STRAIGHT);
    see_wall(450);  // nearer again
    assert_int_equal(kilob_wall_avoidance(), 1);
    assert_int_equal(kilob_wall_avoidance(), 1);
    assert_true(get_direction() != STRAIGHT);
}

TEST(a_wall_is_forgotten_a_second_after_its_last_message) {
    meet_wall();
    see_wall(500);
    assert_int_equal(kilob_wall_avoidance(), 1);
    kilo_ticks += SEC_TO_TICKS(1);
    assert_int_equal(kilob_wall_avoidance(), 1);
    kilo_ticks++;
    assert_int_equal(kilob_wall_avoidance(), 0);
}

TEST(a_robot_that_turns_too_long_tries_the_other_side) {
    meet_wall();
    see_wall(500);
    (void)kilob_wall_avoidance();
    direction_t side = get_direction();
    for (int change = 0; change < 2; change++) {
        for (uint32_t tick = 0; tick <= MS_TO_TICKS(7500); tick++) {
            assert_int_equal(get_direction(), side);
            kilo_ticks++;
            see_wall(500);
            assert_int_equal(kilob_wall_avoidance(), 1);
        }
        side = other(side);
        assert_int_equal(get_direction(), side);
    }
}

TEST(either_side_is_drawn_equally_often) {
    g_ran_set_seed_uint32(5);
    uint32_t lefts = 0;
    const uint32_t times = 400;
    for (uint32_t i = 0; i < times; i++) {
        meet_wall();
        see_wall(500);
        (void)kilob_wall_avoidance();
        lefts += get_direction() == LEFT;
    }
    assert_binomial(lefts, times, 0.5);
}

// Decisions

static void collect(uint8_t first_id, const char *opinions) {
    for (; *opinions != 0; opinions++)
        kilob_cdms_collect(first_id++, (opinion_t)(*opinions - '0'), 0.1 * (*opinions - '0'));
}

TEST(the_newest_opinions_of_different_robots_are_kept) {
    assert_int_equal(kilob_cdms_init(5, OPINION_BUFFER_CAPACITY), 1);
    assert_int_equal(kilob_cdms_init(5, 3), 0);
    collect(1, "012");
    kilob_cdms_collect(1, 4, 0.5);  // again: it is the newest now
    assert_int_equal(kilob_cdms_count_collected_opinions(), 3);
    uint8_t ids[3];
    kilob_cdms_get_last_neighborhoods(ids);
    assert_memory_equal(ids, ((uint8_t[]){2, 3, 1}), 3);
    kilob_cdms_collect(9, 1, 0.5);  // the oldest goes
    assert_int_equal(kilob_cdms_collected_opinion_info(0).kilo_id, 3);
    assert_int_equal(kilob_cdms_collected_opinion_info(2).kilo_id, 9);
    kilob_cdms_clear_buffer();
    assert_int_equal(kilob_cdms_count_collected_opinions(), 0);
    assert_int_equal(kilob_cdms_init(5, 0), 0);
    collect(1, "012");
    assert_int_equal(kilob_cdms_count_collected_opinions(), 0);
}

TEST(a_majority_counts_the_robot_itself_and_a_tie_changes_nothing) {
    kilob_cdms_init(5, 5);
    assert_int_equal(kilob_cdms_majority_rule(3), 3);
    collect(1, "11220");
    assert_int_equal(kilob_cdms_majority_rule(1), 1);
    assert_int_equal(kilob_cdms_majority_rule(2), 2);
    assert_int_equal(kilob_cdms_majority_rule(4), 4);  // two each
    kilob_cdms_collect(5, 2, 0);
    assert_int_equal(kilob_cdms_majority_rule(4), 2);
}

TEST(a_voter_takes_the_opinion_of_any_neighbour) {
    fake_reset();
    kilob_cdms_init(3, 3);
    uint8_t from = 0;
    assert_int_equal(kilob_cdms_voter_model_with_kilouid(2, &from), 2);
    assert_int_equal(from, (uint8_t)kilo_uid);
    collect(1, "100");
    g_ran_set_seed_uint32(11);
    uint32_t ones = 0;
    const uint32_t times = 600;
    for (uint32_t i = 0; i < times; i++) ones += kilob_cdms_voter_model(2) == 1;
    assert_binomial(ones, times, 1.0 / 3);
    const opinion_t taken = kilob_cdms_voter_model_with_kilouid(2, &from);
    assert_int_equal(taken, from == 1);
}

TEST(unanimity_and_comparison_need_all_or_the_best) {
    kilob_cdms_init(5, 3);
    assert_int_equal(kilob_cdms_unanimity_rule(4), 4);
    collect(1, "222");
    assert_int_equal(kilob_cdms_unanimity_rule(4), 2);
    collect(3, "3");
    assert_int_equal(kilob_cdms_unanimity_rule(4), 4);
    assert_int_equal(kilob_cdms_direct_comparison(4, 0.25), 3);
    assert_int_equal(kilob_cdms_direct_comparison(4, 0.35), 4);
    assert_int_equal(kilob_cdms_direct_comparison(4, 0.0), 3);
}

TEST(opinions_and_durations_are_drawn_by_chance) {
    kilob_cdms_init(4, 3);
    g_ran_set_seed_uint32(2);
    uint32_t threes = 0;
    double sum = 0;
    for (int i = 0; i < 1000; i++) {
        const opinion_t drawn = kilob_cdms_random_opinion();
        assert_in_range(drawn, 0, 3);
        threes += drawn == 3;
        sum += kilob_cdms_duration(10);
    }
    assert_binomial(threes, 1000, 0.25);
    assert_true(sum > 8500 && sum < 11500);
}

// Gradients

static int escapes;
static void note_escape(void) { escapes++; }

enum { PERIOD = 5 * TICKS_PER_SEC };

static void follow(uint8_t can_stuck) {
    fake_reset();
    init_motors();
    g_ran_set_seed_uint32(3);
    escapes = 0;
    kilo_ticks = 1000;
    kilob_gradient_tracking_init(5, 2, 0, 4, 0, 12);
    kilob_gradient_tracking_reset();
    kilob_gradient_tracking_config_add(2, kilob_gradient_tracking_decreasing, note_escape,
                                       can_stuck);
}

static void cell_says(uint8_t value) {
    IR_message_t message = {.type = NORMAL, .data = {0, 0, value, 7, 7, 7}};
    distance_measurement_t distance = {0, 0};
    kilob_gradient_tracking_message_received(&message, &distance);
}

static void pass_period(void) {
    kilo_ticks += PERIOD;
    kilob_gradient_tracking();
}

TEST(a_robot_turns_when_a_gradient_goes_the_wrong_way_and_then_goes_on) {
    follow(0);
    assert_int_equal(kilob_gradient_has_active(), 1);
    cell_says(9);  // nothing to compare it with: higher than nothing
    const direction_t side = get_direction();
    assert_true(side == LEFT || side == RIGHT);
    cell_says(10);  // it turns already
    kilob_gradient_tracking();
    assert_int_equal(get_direction(), side);
    kilo_ticks += 4 * TICKS_PER_SEC;
    kilob_gradient_tracking();
    assert_int_equal(get_direction(), STRAIGHT);
    cell_says(8);
    assert_int_equal(get_direction(), STRAIGHT);
    pass_period();
    cell_says(9);
    assert_int_equal(get_direction(), side);  // the side is kept
}

TEST(a_robot_that_goes_across_turns_a_little) {
    follow(0);
    cell_says(5);
    kilo_ticks += 4 * TICKS_PER_SEC;
    kilob_gradient_tracking();
    cell_says(5);
    pass_period();
    assert_true(get_direction() != STRAIGHT);
    kilo_ticks += 2 * TICKS_PER_SEC - 1;
    kilob_gradient_tracking();
    assert_true(get_direction() != STRAIGHT);
    kilo_ticks++;
    kilob_gradient_tracking();
    assert_int_equal(get_direction(), STRAIGHT);
}

TEST(a_robot_goes_on_while_anything_changes) {
    follow(0);
    cell_says(5);
    kilo_ticks += 4 * TICKS_PER_SEC;
    kilob_gradient_tracking();
    cell_says(4);  // lower than before
    pass_period();
    cell_says(4);
    cell_says(3);  // its lowest value is another one
    pass_period();
    cell_says(3);  // its highest value is
    pass_period();
    pass_period();  // silence
    assert_int_equal(get_direction(), STRAIGHT);
    cell_says(0);
    pass_period();
    cell_says(0);  // it stays away
    pass_period();
    assert_int_equal(get_direction(), STRAIGHT);
}

TEST(a_gradient_is_turned_from_to_either_side) {
    uint32_t lefts = 0;
    for (uint32_t seed = 1; seed <= 100; seed++) {
        follow(0);
        g_ran_set_seed_uint32(seed);
        cell_says(0);
        pass_period();  // escaped: the side is drawn anew
        cell_says(5);
        lefts += get_direction() == LEFT;
    }
    assert_binomial(lefts, 100, 0.5);
}

TEST(a_robot_that_receives_zero_only_has_escaped) {
    follow(1);
    cell_says(0);
    assert_int_equal(get_direction(), UNDEFINED);
    pass_period();
    assert_int_equal(escapes, 1);
    assert_int_equal(kilob_gradient_has_active(), 0);
    pass_period();  // silence is no news
    assert_int_equal(escapes, 1);
    cell_says(3);
    assert_int_equal(kilob_gradient_has_active(), 1);
}

TEST(a_robot_that_may_be_stuck_changes_its_side_now_and_then) {
    follow(1);
    cell_says(5);
    const direction_t side = get_direction();
    kilo_ticks += 4 * TICKS_PER_SEC;
    kilob_gradient_tracking();
    for (int period = 0; period < 3; period++) {
        cell_says((uint8_t)(4 - period));
        pass_period();
    }
    cell_says(9);
    assert_int_equal(get_direction(), other(side));
    kilo_ticks += 4 * TICKS_PER_SEC;
    kilob_gradient_tracking();
    for (int period = 0; period < 3; period++) {
        cell_says((uint8_t)(2 - period / 2));
        pass_period();
    }
    cell_says(9);
    assert_int_equal(get_direction(), side);
}

TEST(increasing_is_the_other_way_and_four_gradients_are_the_most) {
    follow(0);
    assert_int_equal(kilob_gradient_tracking_increasing(0, 0), 0);
    assert_int_equal(kilob_gradient_tracking_increasing(0, 3), 1);
    assert_int_equal(kilob_gradient_tracking_increasing(0, 0xFF), 0);
    assert_int_equal(kilob_gradient_tracking_decreasing(0, 0), 0);
    for (uint8_t i = 0; i < 4; i++)
        kilob_gradient_tracking_config_add(3, kilob_gradient_tracking_increasing, note_escape, 0);
    for (int period = 0; period < 2; period++) {
        cell_says(0);  // bytes 3 are higher than nothing at first: it turns for a period
        pass_period();
    }
    // Byte 2 is 0, bytes 3 are not.
    assert_int_equal(escapes, 1);
    kilob_gradient_tracking_reset();
    assert_int_equal(kilob_gradient_has_active(), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_wall_the_robot_is_left_alone),
        cmocka_unit_test(a_robot_turns_from_a_wall_until_its_light_gets_weaker_then_goes_straight),
        cmocka_unit_test(a_wall_is_forgotten_a_second_after_its_last_message),
        cmocka_unit_test(a_robot_that_turns_too_long_tries_the_other_side),
        cmocka_unit_test(either_side_is_drawn_equally_often),
        cmocka_unit_test(the_newest_opinions_of_different_robots_are_kept),
        cmocka_unit_test(a_majority_counts_the_robot_itself_and_a_tie_changes_nothing),
        cmocka_unit_test(a_voter_takes_the_opinion_of_any_neighbour),
        cmocka_unit_test(unanimity_and_comparison_need_all_or_the_best),
        cmocka_unit_test(opinions_and_durations_are_drawn_by_chance),
        cmocka_unit_test(a_robot_turns_when_a_gradient_goes_the_wrong_way_and_then_goes_on),
        cmocka_unit_test(a_robot_that_goes_across_turns_a_little),
        cmocka_unit_test(a_robot_goes_on_while_anything_changes),
        cmocka_unit_test(a_gradient_is_turned_from_to_either_side),
        cmocka_unit_test(a_robot_that_receives_zero_only_has_escaped),
        cmocka_unit_test(a_robot_that_may_be_stuck_changes_its_side_now_and_then),
        cmocka_unit_test(increasing_is_the_other_way_and_four_gradients_are_the_most),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
