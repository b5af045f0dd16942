#include "neighbours.h"

#include <signal.h>
#include <string.h>
#include <sys/time.h>

#include "random.h"
#include "support.h"
#include "wire.h"

#define WINDOW 18
#define TIMEOUT 76

static neighbours_t table_of(uint8_t capacity, uint16_t timeout_ticks) {
    neighbours_t table;
    memset(&table, 0xA5, sizeof table);
    neighbours_init(&table, capacity, timeout_ticks);
    return table;
}

static void all_heard(neighbours_t *table, uint16_t first_uid, uint16_t count, uint32_t now) {
    for (uint16_t i = 0; i < count; i++) neighbours_heard(table, (uint16_t)(first_uid + i), now);
}

TEST(an_empty_table_counts_nobody) {
    const neighbours_t table = table_of(100, TIMEOUT);
    assert_int_equal(neighbours_count(&table, 0, WINDOW), 0);
    assert_int_equal(neighbours_count(&table, 1000000, WINDOW), 0);
}

TEST(a_hundred_distinct_senders_are_counted_however_often_they_speak) {
    neighbours_t table = table_of(100, TIMEOUT);
    for (uint32_t now = 0; now < 10; now++) all_heard(&table, 1, 100, now);
    assert_int_equal(neighbours_count(&table, 10, WINDOW), 100);
    assert_int_equal(table.dropped, 0);
}

TEST(every_uid_is_as_good_as_any_other) {
    neighbours_t table = table_of(100, TIMEOUT);
    const uint16_t uids[] = {0, 1, 255, 256, 257, 0x7FFF, 0x8000, 0xFFFF};
    for (uint8_t i = 0; i < 8; i++) {
        neighbours_heard(&table, uids[i], 5);
        assert_int_equal(neighbours_count(&table, 5, WINDOW), i + 1);
    }
}

TEST(a_sender_counts_until_the_window_is_over_the_last_tick_included) {
    neighbours_t table = table_of(100, TIMEOUT);
    neighbours_heard(&table, 1, 100);
    assert_int_equal(neighbours_count(&table, 100, WINDOW), 1);
    assert_int_equal(neighbours_count(&table, 100 + WINDOW, WINDOW), 1);
    assert_int_equal(neighbours_count(&table, 100 + WINDOW + 1, WINDOW), 0);
}

TEST(only_those_heard_within_the_window_are_counted) {
    neighbours_t table = table_of(100, TIMEOUT);
    for (uint16_t i = 0; i < 50; i++) neighbours_heard(&table, i, 1000u + i);
    assert_int_equal(neighbours_count(&table, 1049, WINDOW), WINDOW + 1);
    assert_int_equal(neighbours_count(&table, 1059, WINDOW), WINDOW + 1 - 10);
}

TEST(a_window_longer_than_the_time_out_ends_with_it) {
    neighbours_t table = table_of(100, TIMEOUT);
    neighbours_heard(&table, 1, 100);
    assert_int_equal(neighbours_count(&table, 100 + TIMEOUT, 30000), 1);
    assert_int_equal(neighbours_count(&table, 100 + TIMEOUT + 1, 30000), 0);

    // Likewise while another robot is received.
    for (uint32_t now = 101; now < 300; now++) neighbours_heard(&table, 2, now);
    assert_int_equal(neighbours_count(&table, 300, 30000), 1);
}

TEST(the_count_is_right_if_a_message_comes_after_the_reader_looked_at_the_clock) {
    neighbours_t table = table_of(100, TIMEOUT);
    neighbours_heard(&table, 1, 100);
    neighbours_heard(&table, 2, 118);
    neighbours_heard(&table, 3, 119);
    assert_int_equal(neighbours_count(&table, 118, WINDOW), 2);  // seen from 119: 1 is too old
    neighbours_heard(&table, 1, 119);
    assert_int_equal(neighbours_count(&table, 118, WINDOW), 3);
}

TEST(a_full_table_turns_new_senders_away_and_counts_their_messages) {
    neighbours_t table = table_of(10, TIMEOUT);
    all_heard(&table, 1, 10, 0);
    all_heard(&table, 11, 5, 1);
    neighbours_heard(&table, 11, 2);
    assert_int_equal(table.dropped, 6);
    assert_int_equal(neighbours_count(&table, 2, 2), 10);

    all_heard(&table, 1, 10, 3);  // none of the old ones was replaced
    assert_int_equal(table.dropped, 6);
}

TEST(the_count_of_messages_turned_away_saturates) {
    neighbours_t table = table_of(1, TIMEOUT);
    for (uint32_t i = 0; i < 70000; i++) neighbours_heard(&table, (uint16_t)(i & 1), 0);
    assert_int_equal(table.dropped, 35000);
    for (uint32_t i = 0; i < 70000; i++) neighbours_heard(&table, (uint16_t)(i & 1), 0);
    assert_int_equal(table.dropped, UINT16_MAX);
}

TEST(the_place_of_a_sender_that_timed_out_is_given_to_the_next) {
    neighbours_t table = table_of(2, TIMEOUT);
    neighbours_heard(&table, 1, 0);
    neighbours_heard(&table, 2, 50);
    neighbours_heard(&table, 3, TIMEOUT);  // 1 has its place for this last tick
    assert_int_equal(table.dropped, 1);
    neighbours_heard(&table, 3, TIMEOUT + 1);
    assert_int_equal(table.dropped, 1);
    assert_int_equal(neighbours_count(&table, TIMEOUT + 1, TIMEOUT), 2);
}

TEST(a_hundred_senders_replaced_by_a_hundred_others_leave_no_trace) {
    neighbours_t table = table_of(100, TIMEOUT);
    for (uint16_t generation = 0; generation < 20; generation++) {
        const uint32_t now = generation * (TIMEOUT + 1u);
        all_heard(&table, (uint16_t)(generation * 100), 100, now);
        assert_int_equal(neighbours_count(&table, now, WINDOW), 100);
    }
    assert_int_equal(table.dropped, 0);
}

// A sender heard once must not come back to life when the low 16 bits of the ticks come round.
TEST(nobody_comes_back_after_a_silence_of_any_length) {
    for (uint32_t silence = TIMEOUT + 1; silence < 140000; silence += 7) {
        neighbours_t table = table_of(100, TIMEOUT);
        neighbours_heard(&table, 1, 5);
        assert_int_equal(neighbours_count(&table, 5 + silence, WINDOW), 0);
        neighbours_heard(&table, 2, 5 + silence);
        assert_int_equal(neighbours_count(&table, 5 + silence, WINDOW), 1);
    }
}

TEST(nobody_comes_back_while_others_chatter_or_speak_as_seldom_as_they_may) {
    const uint32_t periods[] = {1, 16, 1023, 1024, 31999, 32000, 32001, 65536, 65537};
    for (size_t i = 0; i < sizeof periods / sizeof *periods; i++) {
        neighbours_t table = table_of(100, NEIGHBOURS_TIMEOUT_MAX);
        neighbours_heard(&table, 1, 0);
        for (uint32_t now = periods[i]; now < 300000; now += periods[i]) {
            neighbours_heard(&table, 2, now);
            const int expected = now <= NEIGHBOURS_TIMEOUT_MAX ? 2 : 1;
            assert_int_equal(neighbours_count(&table, now, NEIGHBOURS_TIMEOUT_MAX), expected);
        }
    }
}

// Against a plain list of when each of 300 senders was last heard, over the wrap of 16 bits and of
// 32, with a crowd that changes.
TEST(the_table_agrees_with_a_plain_list_over_every_wrap) {
    enum { SENDERS = 90 };
    for (int round = 0; round < 2; round++) {
        neighbours_t table = table_of(100, TIMEOUT);
        uint32_t last[SENDERS];
        bool known[SENDERS] = {false};
        random_t random;
        random_seed(&random, 9, (uint16_t)round);
        uint32_t now = round == 0 ? 0 : UINT32_MAX - 100000;
        for (int step = 0; step < 200000; step++) {
            now += random_next(&random) % 64 == 0 ? random_next(&random) % 200 : 1;
            const uint32_t uid = random_next(&random) % SENDERS;
            if (random_next(&random) % 4 != 0) {
                neighbours_heard(&table, (uint16_t)uid, now);
                last[uid] = now;
                known[uid] = true;
            }
            if (step % 8 != 0) continue;
            int expected = 0;
            for (int i = 0; i < SENDERS; i++) expected += known[i] && now - last[i] <= WINDOW;
            assert_int_equal(neighbours_count(&table, now, WINDOW), expected);
        }
        assert_int_equal(table.dropped, 0);
    }
}

// The hot path is short because in a settled crowd each sender is found where it is looked for.
TEST(a_newcomer_is_put_where_it_is_heard_and_those_who_go_leave_no_gap) {
    neighbours_t table = table_of(100, TIMEOUT);
    const uint16_t first[] = {10, 30, 20};
    const uint16_t later[] = {10, 40, 20};  // 30 falls silent, 40 speaks up in its place
    for (uint32_t now = 0; now < 64; now += 16) {
        for (int i = 0; i < 3; i++) neighbours_heard(&table, first[i], now);
    }
    for (uint32_t now = 64; now < 2400; now += 16) {
        for (int i = 0; i < 3; i++) neighbours_heard(&table, later[i], now);
    }
    assert_int_equal(table.used, 3);
    uint8_t first_place = 0;
    while (table.uid[first_place] != 10) first_place++;
    for (uint8_t i = 0; i < 3; i++) assert_int_equal(table.uid[(first_place + i) % 3], later[i]);
    assert_int_equal(table.next, first_place);
}

static neighbours_t interrupted;
static volatile sig_atomic_t crowd;

// All that were in the table time out, and twenty others are there instead.
static void change_the_crowd(int unused) {
    (void)unused;
    crowd++;
    all_heard(&interrupted, (uint16_t)(crowd * 20), 20, (uint32_t)crowd * 200);
}

// On a robot messages come in while loop() counts. Here a timer's signal is the interrupt.
TEST(a_count_interrupted_by_messages_is_right) {
    interrupted = table_of(100, TIMEOUT);
    change_the_crowd(0);
    signal(SIGALRM, change_the_crowd);
    const struct itimerval often = {{0, 50}, {0, 50}};
    const struct itimerval never = {{0, 0}, {0, 0}};
    setitimer(ITIMER_REAL, &often, NULL);
    uint32_t wrong = 0;
    while (crowd < 3000) {
        const uint32_t now = (uint32_t)crowd * 200;
        wrong += neighbours_count(&interrupted, now, WINDOW) != 20;
    }
    setitimer(ITIMER_REAL, &never, NULL);
    assert_int_equal(wrong, 0);
}

TEST(the_limits_are_those_of_the_wire) {
#define LIMITS(name, key, preset, least, most)                            \
    if (key == WIRE_KEY_CAPACITY) assert_int_equal(most, NEIGHBOURS_MAX); \
    if (key == WIRE_KEY_TIMEOUT_TICKS) assert_int_equal(most, NEIGHBOURS_TIMEOUT_MAX);
    WIRE_CONFIG_KEYS(LIMITS)
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_table_counts_nobody),
        cmocka_unit_test(a_hundred_distinct_senders_are_counted_however_often_they_speak),
        cmocka_unit_test(every_uid_is_as_good_as_any_other),
        cmocka_unit_test(a_sender_counts_until_the_window_is_over_the_last_tick_included),
        cmocka_unit_test(only_those_heard_within_the_window_are_counted),
        cmocka_unit_test(a_window_longer_than_the_time_out_ends_with_it),
        cmocka_unit_test(
            the_count_is_right_if_a_message_comes_after_the_reader_looked_at_the_clock),
        cmocka_unit_test(a_full_table_turns_new_senders_away_and_counts_their_messages),
        cmocka_unit_test(the_count_of_messages_turned_away_saturates),
        cmocka_unit_test(the_place_of_a_sender_that_timed_out_is_given_to_the_next),
        cmocka_unit_test(a_hundred_senders_replaced_by_a_hundred_others_leave_no_trace),
        cmocka_unit_test(nobody_comes_back_after_a_silence_of_any_length),
        cmocka_unit_test(nobody_comes_back_while_others_chatter_or_speak_as_seldom_as_they_may),
        cmocka_unit_test(the_table_agrees_with_a_plain_list_over_every_wrap),
        cmocka_unit_test(a_newcomer_is_put_where_it_is_heard_and_those_who_go_leave_no_gap),
        cmocka_unit_test(a_count_interrupted_by_messages_is_right),
        cmocka_unit_test(the_limits_are_those_of_the_wire),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
