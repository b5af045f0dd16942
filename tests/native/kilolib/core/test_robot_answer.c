/// Answers of a robot's runtime to questions for its vitals: to which, when, and what they say.
#include "kilolib/core/robot_answer.h"

#include <string.h>

#include "../../firmware/support.h"
#include "kilolib/core/gains.h"
#include "kilolib/core/robot_query.h"
#include "message_crc.h"

#define UID 0x1234

static const uint8_t VITALS[ROBOT_QUERY_BYTES] = {0xE1, 6, 17, 0xFF, 0xFF};

static robot_answer_t asked(const uint8_t *query) {
    robot_answer_t answer = {0};
    robot_answer_take(&answer, query, UID);
    return answer;
}

// Matches up to and with the first attempt; 0: there is none in `most`.
static int first_attempt(robot_answer_t *answer, int most) {
    for (int match = 1; match <= most; match++)
        if (robot_answer_is_due(answer)) return match;
    return 0;
}

TEST(an_answer_is_due_in_its_slot) {
    for (int nonce = 0; nonce < 256; nonce++) {
        const uint8_t query[] = {0xE1, 8, (uint8_t)nonce, 0x34, 0x12};
        robot_answer_t answer = asked(query);
        const int due = robot_query_slot(UID, (uint8_t)nonce, 8) + 1;
        assert_int_equal(robot_answer_matches(&answer), due);
        assert_int_equal(first_attempt(&answer, 300), due);
    }
}

TEST(other_questions_and_those_to_others_change_nothing) {
    const uint8_t identity[] = {0xE0, 0, 0, 0xFF, 0xFF}, other[] = {0xE1, 0, 0, 0x35, 0x12};
    const uint8_t beyond[] = {0xE2 + GAIN_ENTRIES, 0, 0, 0xFF, 0xFF};
    const uint8_t *queries[] = {identity, other, beyond};
    for (int i = 0; i < 3; i++) {
        robot_answer_t answer = asked(queries[i]);
        assert_int_equal(robot_answer_matches(&answer), 0);
        assert_int_equal(first_attempt(&answer, 300), 0);
        answer = asked(VITALS);
        const robot_answer_t before = answer;
        robot_answer_take(&answer, queries[i], UID);
        assert_memory_equal(&answer, &before, sizeof before);
    }
}

TEST(a_busy_channel_costs_an_attempt_a_match_up_to_four) {
    robot_answer_t answer = asked(VITALS);
    first_attempt(&answer, 300);
    for (int attempt = 2; attempt <= ROBOT_ANSWER_ATTEMPTS; attempt++) {
        assert_int_equal(robot_answer_matches(&answer), 1);
        assert_true(robot_answer_is_due(&answer));
    }
    assert_int_equal(robot_answer_matches(&answer), 0);
    assert_false(robot_answer_is_due(&answer));
}

TEST(an_answer_that_has_gone_out_is_over) {
    robot_answer_t answer = asked(VITALS);
    first_attempt(&answer, 300);
    robot_answer_end(&answer);
    assert_int_equal(first_attempt(&answer, 300), 0);
}

TEST(a_question_anew_before_the_answer_takes_the_place_of_the_first) {
    const uint8_t again[] = {0xE1, 0, 0, 0xFF, 0xFF};
    robot_answer_t answer = asked(VITALS);
    first_attempt(&answer, 300);
    robot_answer_take(&answer, again, UID);
    int attempts = 0;
    for (int match = 0; match < 300; match++) attempts += robot_answer_is_due(&answer);
    assert_int_equal(attempts, ROBOT_ANSWER_ATTEMPTS);
}

// The answer of a robot that was asked by `query`, and heard `count` others before.
static message_t answer_of(const uint8_t *query, uint8_t state, int16_t voltage, int count) {
    const robot_answer_t answer = asked(query);
    robot_heard_t heard = {{0}};
    message_t other = {.data = {0x99, 0x98, 0xE1}, .type = BOOTPGM_REPORT};
    for (int i = 0; i < count; i++)
        robot_answer_hear(&heard, &other, &(distance_measurement_t){0x123 + (int16_t)i, 0x3D6});
    uint8_t content[REPORT_CONTENT] = {1, 2, 3, 4};
    if (answer.first == ROBOT_QUERY_VITALS) robot_answer_vitals(&heard, voltage, content);
    message_t message;
    memset(&message, 0xA5, sizeof message);
    robot_answer_fill(&answer, &message, UID, state, content);
    assert_int_equal(message.type, 0x8D);
    assert_int_equal(message.crc, message_crc(&message));
    return message;
}

TEST(an_answer_tells_voltage_and_state) {
    const message_t answer = answer_of(VITALS, 2, 0x2C7, 0);
    const uint8_t data[] = {0x34, 0x12, 0xE1, 0xC7, 0, 0, 0x80, 0x12, 0};
    assert_memory_equal(answer.data, data, sizeof data);
}

TEST(a_voltage_that_is_not_known_is_all_ones) {
    const message_t answer = answer_of(VITALS, 0, -1, 0);
    const uint8_t data[] = {0x34, 0x12, 0xE1, 0xFF, 0, 0, 0xC0, 0x10, 0};
    assert_memory_equal(answer.data, data, sizeof data);
}

TEST(an_answer_tells_the_gains_of_the_last_vitals_that_came_in_and_counts_them) {
    for (int count = 1; count < 9; count++) {
        const message_t answer = answer_of(VITALS, 0, 0x2C7, count);
        const uint8_t data[] = {
            0x34, 0x12, 0xE1, 0xC7, (uint8_t)(0x22 + count), 0xD6, (uint8_t)(0x8D | count % 4 << 4),
            0x10, 0};
        assert_memory_equal(answer.data, data, sizeof data);
    }
}

TEST(other_messages_that_come_in_are_not_measured) {
    robot_heard_t heard = {{0}}, before = heard;
    message_t other = {.data = {0x99, 0x98, 0xE1}, .type = BOOTPGM_QUERY};
    const distance_measurement_t measured = {300, 900};
    robot_answer_hear(&heard, &other, &measured);
    other.type = BOOTPGM_REPORT;
    other.data[REPORT_FIRST] = ROBOT_QUERY_GAINS;
    robot_answer_hear(&heard, &other, &measured);
    assert_memory_equal(&heard, &before, sizeof before);
}

TEST(an_answer_about_tables_tells_which_entry_in_its_state) {
    for (uint8_t entry = 0; entry < GAIN_ENTRIES; entry++) {
        const uint8_t query[] = {(uint8_t)(0xE2 + entry), 0, 0, 0x34, 0x12};
        const message_t answer = answer_of(query, 6, 0x2C7, 2);
        const uint8_t data[] = {0x34, 0x12, query[0], 1, 2, 3, 4, (uint8_t)(0x26 + 16 * entry), 0};
        assert_memory_equal(answer.data, data, sizeof data);
        assert_true(data[REPORT_STATE] >= ROBOT_REPORT_IN_PROGRAM);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_answer_is_due_in_its_slot),
        cmocka_unit_test(other_questions_and_those_to_others_change_nothing),
        cmocka_unit_test(a_busy_channel_costs_an_attempt_a_match_up_to_four),
        cmocka_unit_test(an_answer_that_has_gone_out_is_over),
        cmocka_unit_test(a_question_anew_before_the_answer_takes_the_place_of_the_first),
        cmocka_unit_test(an_answer_tells_voltage_and_state),
        cmocka_unit_test(a_voltage_that_is_not_known_is_all_ones),
        cmocka_unit_test(an_answer_tells_the_gains_of_the_last_vitals_that_came_in_and_counts_them),
        cmocka_unit_test(other_messages_that_come_in_are_not_measured),
        cmocka_unit_test(an_answer_about_tables_tells_which_entry_in_its_state),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
