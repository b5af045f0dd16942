#include "core_support.h"
#include "runtime/core/robot_reports.h"

static message_t answer_of(uint8_t uid) {
    const message_t message = {{uid, 0x12, 0xE1, 1, 2, 3, 4, 0x12, 9}, 0x8D, 0};
    return message;
}

TEST(an_answer_becomes_a_frame_to_the_host_with_its_cell) {
    for (uint8_t cell = 0; cell < 4; cell++) {
        robot_reports_t reports = {0};
        uint8_t frame[ROBOT_REPORT_BYTES];
        const message_t answer = answer_of(0x34);
        assert_true(robot_reports_add(&reports, &answer, cell));
        assert_true(robot_reports_take(&reports, frame));
        const uint8_t expected[] = {(uint8_t)(0x1A | cell << 6), 0x34, 0x12, 1, 2, 3, 4, 0x12};
        assert_memory_equal(frame, expected, sizeof expected);
        assert_false(robot_reports_take(&reports, frame));
    }
}

TEST(other_messages_are_the_programs) {
    robot_reports_t reports = {0};
    for (int type = 0; type < 256; type++) {
        message_t message = answer_of(1);
        message.type = (uint8_t)type;
        if (type != 0x8D) assert_false(robot_reports_add(&reports, &message, 0));
    }
    assert_int_equal(reports.used, 0);
}

TEST(answers_go_out_in_their_order_and_those_without_a_place_are_lost) {
    robot_reports_t reports = {0};
    uint8_t frame[ROBOT_REPORT_BYTES];
    for (uint8_t round = 0; round < 7; round++) {
        for (uint8_t i = 0; i <= ROBOT_REPORTS; i++) {
            const message_t answer = answer_of((uint8_t)(10 * round + i));
            assert_true(robot_reports_add(&reports, &answer, 0));
        }
        for (uint8_t i = 0; i < ROBOT_REPORTS; i++) {
            assert_true(robot_reports_take(&reports, frame));
            assert_int_equal(frame[1], 10 * round + i);
        }
        assert_false(robot_reports_take(&reports, frame));
        // The next round begins at another place.
        const message_t answer = answer_of(99);
        assert_true(robot_reports_add(&reports, &answer, 0));
        assert_true(robot_reports_take(&reports, frame));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_answer_becomes_a_frame_to_the_host_with_its_cell),
        cmocka_unit_test(other_messages_are_the_programs),
        cmocka_unit_test(answers_go_out_in_their_order_and_those_without_a_place_are_lost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
