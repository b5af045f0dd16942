#include "tracking.h"

#include "support.h"

static params_t every(uint16_t ticks) {
    params_t params;
    params_reset(&params);
    params.TRACKING_TICKS = ticks;
    return params;
}

TEST(without_a_period_nothing_is_ever_due) {
    const params_t params = every(0);
    tracking_t tracking;
    tracking_init(&tracking, &params, 100, 77);
    for (uint32_t now = 100; now < 100000; now++)
        assert_false(tracking_due(&tracking, &params, now));
    assert_int_equal(tracking.number, 0);
}

TEST(reports_are_due_once_each_period_and_are_numbered) {
    const params_t params = every(61);
    tracking_t tracking;
    tracking_init(&tracking, &params, 1000, 0);
    for (uint32_t now = 1000; now < 1000 + 100 * 61; now++) {
        const bool due = tracking_due(&tracking, &params, now);
        assert_int_equal(due, (now - 1000) % 61 == 0);
        assert_false(tracking_due(&tracking, &params, now));
        assert_int_equal(tracking.number, (now - 1000) / 61 + 1);
    }
}

TEST(robots_of_different_uids_begin_at_different_ticks) {
    const params_t params = every(61);
    for (uint16_t uid = 0; uid < 200; uid++) {
        tracking_t tracking;
        uint32_t now = 0;
        tracking_init(&tracking, &params, now, uid);
        while (!tracking_due(&tracking, &params, now)) now++;
        assert_int_equal(now, uid % 61);
    }
}

TEST(after_a_pause_one_report_is_due_and_the_rhythm_stays) {
    const params_t params = every(10);
    tracking_t tracking;
    tracking_init(&tracking, &params, UINT32_MAX - 4, 0);  // ticks wrap meanwhile
    assert_true(tracking_due(&tracking, &params, UINT32_MAX - 4));
    assert_true(tracking_due(&tracking, &params, 1002));
    assert_false(tracking_due(&tracking, &params, 1004));
    assert_true(tracking_due(&tracking, &params, 1005));
    assert_int_equal(tracking.number, 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_period_nothing_is_ever_due),
        cmocka_unit_test(reports_are_due_once_each_period_and_are_numbered),
        cmocka_unit_test(robots_of_different_uids_begin_at_different_ticks),
        cmocka_unit_test(after_a_pause_one_report_is_due_and_the_rhythm_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
