#include "core_support.h"
#include "runtime/core/turns.h"

TEST(a_turn_comes_every_four_ticks_and_the_cells_follow_one_another) {
    turns_t turns = {0, 0, 0};
    turns_init(&turns);
    for (int tick = 1; tick <= 64; tick++) {
        const bool due = turns_tick(&turns);
        assert_int_equal(due, tick % 4 == 0);
        if (!due) continue;
        assert_int_equal(turns_next_cell(&turns), tick / 4 % 4);
        turns_passed(&turns);
        assert_int_equal(turns.cell, tick / 4 % 4);
    }
}

TEST(a_turn_stays_open_while_a_frame_is_coming_in) {
    turns_t turns = {0, 0, 2};
    turns_init(&turns);
    for (int i = 0; i < 3; i++) assert_false(turns_tick(&turns));
    for (int i = 0; i < 5; i++) {
        assert_true(turns_tick(&turns));
        assert_int_equal(turns_next_cell(&turns), 3);
    }
}

TEST(a_busy_channel_ends_the_turn_and_starts_the_timer_anew_with_a_random_match) {
    for (int drawn = 0; drawn < 600; drawn++) {
        turns_t turns = {1020, TICK_MATCH, 3};
        const int low = drawn % 256;
        assert_int_equal(turns_retry(&turns, drawn), low == 0 ? 256 : low);
        assert_int_equal(turns.cell, 0);
        assert_int_equal(turns.clock, 0);
        assert_false(turns_tick(&turns));
        assert_int_equal(turns.clock, low == 0 ? 256 : low);
        assert_int_equal(turns.increment, TICK_MATCH);
    }
}

TEST(ticks_to_go_are_those_that_stepping_takes) {
    for (uint16_t clock = 0; clock <= 1300; clock++)
        for (uint16_t increment = 1; increment <= 256; increment++) {
            const turns_t turns = {clock, increment, 0};
            turns_t stepped = turns;
            uint8_t ticks = 1;
            while (!turns_tick(&stepped)) ticks++;
            assert_int_equal(turns_ticks_to_go(&turns), ticks);
            assert_int_equal(turns_due_at_next_tick(&turns), ticks == 1);
        }
}

TEST(the_receiver_goes_round_the_cells) {
    for (uint8_t cell = 0; cell < 4; cell++) {
        uint8_t stepped = cell;
        for (uint8_t dwells = 0; dwells < 9; dwells++) {
            assert_int_equal(turns_listening_after(cell, dwells), stepped);
            stepped = turns_listening_after(stepped, 1);
        }
    }
    assert_int_equal(turns_listening_after(3, 1), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_turn_comes_every_four_ticks_and_the_cells_follow_one_another),
        cmocka_unit_test(a_turn_stays_open_while_a_frame_is_coming_in),
        cmocka_unit_test(
            a_busy_channel_ends_the_turn_and_starts_the_timer_anew_with_a_random_match),
        cmocka_unit_test(ticks_to_go_are_those_that_stepping_takes),
        cmocka_unit_test(the_receiver_goes_round_the_cells),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
