#include "pfsm.h"

#include "pfsm_robot.h"
#include "support.h"
#include "wire.h"

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

TEST(a_robot_that_starts_late_heeds_walls_at_once) {
    // By a clock whose distance from 0 has no sign any more.
    robot_t r = simplified();
    boot(&r, UINT32_C(0x90000000));
    assert_true(walk_blocked(&r.machine.walk, UINT32_C(0x90000000), WIRE_CELL_WALL));
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
        cmocka_unit_test(a_robot_that_starts_late_heeds_walls_at_once),
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
        cmocka_unit_test(by_the_simplified_rule_every_robot_signals_from_rest_or_from_the_crossing),
        cmocka_unit_test(
            by_firats_rule_informed_robots_alone_signal_from_the_crossing_or_from_rest),
        cmocka_unit_test(skipping_ticks_in_which_nothing_happens_changes_nothing),
        cmocka_unit_test(most_ticks_take_the_short_way),
        cmocka_unit_test(the_same_inputs_give_the_same_lives_on_every_machine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
