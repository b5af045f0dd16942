/// The transmit clock and timer 0's matches, against a timer that is stepped count by count.
#include "../../firmware/support.h"
#include "kilolib/core/transmit_clock.h"

#define TICK_CYCLES ((uint64_t)TICK_COUNTS * COUNT_CYCLES)

/// Timer 0 as the data sheet has it: a count of 8 bits that goes round, and one compare value.
typedef struct {
    uint64_t now;  // cycles
    uint8_t count;
    uint8_t compare;
} stepped_timer_t;

/// Steps to the next match. Returns its time.
static uint64_t step_to_match(stepped_timer_t *timer) {
    do {
        timer->now += COUNT_CYCLES;
        timer->count++;
    } while (timer->count != timer->compare);
    return timer->now;
}

TEST(it_begins_with_ordinary_ticks) {
    transmit_clock_t clock = {77, 3};
    transmit_clock_init(&clock);
    assert_int_equal(clock.counts, 0);
    assert_int_equal(clock.increment, TICK_MATCH);
}

TEST(by_default_every_sixteenth_tick_asks) {
    transmit_clock_t clock;
    transmit_clock_init(&clock);
    for (int round = 0; round < 3; round++) {
        for (int tick = 1; tick <= 16; tick++) {
            assert_false(transmit_clock_is_due(&clock, TX_PERIOD_DEFAULT));
            transmit_clock_match(&clock);
        }
        assert_true(transmit_clock_is_due(&clock, TX_PERIOD_DEFAULT));
        transmit_clock_sent(&clock);
    }
}

TEST(a_silent_program_is_asked_at_every_tick_until_the_clock_wraps) {
    transmit_clock_t clock;
    transmit_clock_init(&clock);
    int asked = 0, tick = 0;
    for (; tick < 257; tick++) {
        transmit_clock_match(&clock);
        asked += transmit_clock_is_due(&clock, TX_PERIOD_DEFAULT);
    }
    assert_int_equal(asked, 257 - 15);
    transmit_clock_match(&clock);
    assert_int_equal(clock.counts, 258 * 255 - 65536);
    assert_false(transmit_clock_is_due(&clock, TX_PERIOD_DEFAULT));
}

TEST(a_failed_attempt_adds_one_match_of_its_own) {
    transmit_clock_t clock = {4000, TICK_MATCH};
    assert_int_equal(transmit_clock_retry(&clock, 0x7F05), 5);
    transmit_clock_match(&clock);
    assert_int_equal(clock.counts, 4005);
    assert_int_equal(clock.increment, TICK_MATCH);
}

TEST(matches_after_a_retry_are_those_of_a_stepped_timer) {
    // An attempt takes 2.4 counts: it fails a bit after the match that it was made at.
    const uint64_t attempt = 2418;
    for (int at = 0; at <= 255; at++) {
        for (int compare = 0; compare <= 255; compare++) {
            stepped_timer_t timer = {1000000, (uint8_t)at, (uint8_t)compare};
            const uint64_t now = timer.now + attempt;
            const uint64_t ordinary =
                timer.now + (at == 255 ? TICK_COUNTS : TICK_MATCH - at) * (uint64_t)COUNT_CYCLES;
            // The timer has gone on by two counts when the compare value changes.
            for (int i = 0; i < 2; i++) {
                timer.now += COUNT_CYCLES;
                timer.count++;
            }
            if (ordinary <= now) continue;
            const timer_matches_t next =
                timer_matches_after_retry(now, ordinary, (uint8_t)compare, TICK_CYCLES);
            assert_int_equal(next.match, step_to_match(&timer));
            timer.compare = TICK_MATCH;
            if (compare == TICK_MATCH) {
                assert_int_equal(next.ordinary, next.match);
            } else {
                assert_int_equal(next.ordinary, step_to_match(&timer));
            }
        }
    }
}

/// Matches of `clock` up to the one that asks, one by one; 0 if that takes too many.
static uint32_t stepped_matches(transmit_clock_t clock, uint16_t period) {
    for (uint32_t matches = 1; matches < 1000; matches++) {
        transmit_clock_match(&clock);
        if (transmit_clock_is_due(&clock, period)) return matches;
    }
    return 0;
}

TEST(the_next_request_is_that_of_a_stepped_clock) {
    static const uint16_t PERIODS[] = {0, 1, 254, 255, 256, 977, 3906, 30000, 65279, 65280};
    static const uint8_t INCREMENTS[] = {0, 1, 100, 254, 255};
    for (size_t p = 0; p < sizeof PERIODS / sizeof *PERIODS; p++) {
        for (size_t i = 0; i < sizeof INCREMENTS; i++) {
            for (uint32_t counts = 0; counts <= UINT16_MAX; counts += 97) {
                const transmit_clock_t clock = {(uint16_t)counts, INCREMENTS[i]};
                assert_int_equal(transmit_clock_matches_to_request(&clock, PERIODS[p]),
                                 stepped_matches(clock, PERIODS[p]));
            }
        }
    }
}

TEST(for_periods_that_the_clock_may_wrap_before_any_match_may_ask) {
    const transmit_clock_t clock = {0, TICK_MATCH};
    assert_int_equal(transmit_clock_matches_to_request(&clock, 65281), 1);
    assert_int_equal(transmit_clock_matches_to_request(&clock, UINT16_MAX), 1);
}

TEST(the_time_of_the_next_request_is_that_of_a_stepped_timer) {
    for (int count = 0; count < 255; count++) {
        for (uint16_t counts = 0; counts < 4100; counts = (uint16_t)(counts + 450)) {
            for (int compare = count + 1; compare <= 255; compare += 5) {
                transmit_clock_t clock = {counts, (uint8_t)compare};
                stepped_timer_t timer = {0, (uint8_t)count, (uint8_t)compare};
                timer_matches_t next;
                next.match = (uint64_t)(compare - count) * COUNT_CYCLES;
                next.ordinary = (uint64_t)(255 - count) * COUNT_CYCLES;
                if (compare == TICK_MATCH) next.ordinary += TICK_CYCLES;
                const uint64_t expected =
                    transmit_clock_next_request(&clock, TX_PERIOD_DEFAULT, next, TICK_CYCLES);
                uint64_t at;
                do {
                    at = step_to_match(&timer);
                    transmit_clock_match(&clock);
                    timer.compare = TICK_MATCH;
                } while (!transmit_clock_is_due(&clock, TX_PERIOD_DEFAULT));
                assert_int_equal(expected, at);
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_begins_with_ordinary_ticks),
        cmocka_unit_test(by_default_every_sixteenth_tick_asks),
        cmocka_unit_test(a_silent_program_is_asked_at_every_tick_until_the_clock_wraps),
        cmocka_unit_test(a_failed_attempt_adds_one_match_of_its_own),
        cmocka_unit_test(matches_after_a_retry_are_those_of_a_stepped_timer),
        cmocka_unit_test(the_next_request_is_that_of_a_stepped_clock),
        cmocka_unit_test(for_periods_that_the_clock_may_wrap_before_any_match_may_ask),
        cmocka_unit_test(the_time_of_the_next_request_is_that_of_a_stepped_timer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
