/// States and commands of a robot: every command in every state.
#include <string.h>

#include "../../firmware/support.h"
#include "kilolib/core/calibration.h"
#include "kilolib/core/gains.h"
#include "kilolib/core/robot_commands.h"
#include "kilolib/core/robot_query.h"
#include "kilolib/core/traits.h"

#define UID 0x8005
#define TURN_LEFT 61

static const robot_state_t STATES[] = {ROBOT_IDLE,    ROBOT_SETUP,    ROBOT_RUNNING, ROBOT_SLEEPING,
                                       ROBOT_BATTERY, ROBOT_CHARGING, ROBOT_MOVING};
#define STATE_COUNT (sizeof STATES / sizeof *STATES)

static robot_core_t robot_in(robot_state_t state) {
    robot_core_t robot;
    memset(&robot, 0, sizeof robot);
    robot.transmit.counts = 77;
    robot_core_init(&robot);
    robot.state = (uint8_t)state;
    return robot;
}

static message_t command(uint8_t type) {
    message_t message;
    memset(&message, 0, sizeof message);
    message.type = type;
    return message;
}

static robot_action_t obey(robot_core_t *robot, const message_t *message) {
    return robot_obey(robot, message, UID, TURN_LEFT);
}

TEST(a_robot_begins_in_idle_with_setup_to_come) {
    robot_core_t robot = robot_in(ROBOT_IDLE);
    assert_int_equal(robot.transmit.counts, 0);
    assert_int_equal(robot.transmit.increment, TICK_MATCH);
    assert_false(robot_takes_motion(&robot));
    assert_true(robot_begins_setup(&robot));
    assert_false(robot_begins_setup(&robot));
}

TEST(types_from_0x80_on_are_commands) {
    for (int type = 0; type <= 0xFF; type++) {
        const message_t message = command((uint8_t)type);
        assert_int_equal(message_is_command(&message), type >= 0x80);
    }
}

TEST(state_commands_stop_the_motors_whatever_the_robot_does) {
    static const struct {
        uint8_t type;
        robot_state_t state;
    } ORDERS[] = {{WAKEUP, ROBOT_IDLE},
                  {SLEEP, ROBOT_SLEEPING},
                  {CHARGE, ROBOT_CHARGING},
                  {VOLTAGE, ROBOT_BATTERY}};
    for (size_t s = 0; s < STATE_COUNT; s++) {
        for (size_t i = 0; i < sizeof ORDERS / sizeof *ORDERS; i++) {
            robot_core_t robot = robot_in(STATES[s]);
            const message_t message = command(ORDERS[i].type);
            assert_int_equal(obey(&robot, &message), ACTION_STOP_MOTORS);
            assert_int_equal(robot.state, ORDERS[i].state);
        }
    }
}

TEST(run_starts_a_robot_that_does_not_run) {
    const message_t message = command(RUN);
    for (size_t s = 0; s < STATE_COUNT; s++) {
        robot_core_t robot = robot_in(STATES[s]);
        const robot_action_t action = obey(&robot, &message);
        if (STATES[s] == ROBOT_RUNNING || STATES[s] == ROBOT_SETUP) {
            assert_int_equal(action, ACTION_NONE);
            assert_int_equal(robot.state, STATES[s]);
        } else {
            assert_int_equal(action, ACTION_START_MOTORS);
            assert_int_equal(robot.state, ROBOT_SETUP);
        }
    }
}

TEST(after_setup_a_robot_runs_unless_a_command_came_meanwhile) {
    for (size_t s = 0; s < STATE_COUNT; s++) {
        robot_core_t robot = robot_in(STATES[s]);
        robot_end_setup(&robot);
        assert_int_equal(robot.state, STATES[s] == ROBOT_SETUP ? ROBOT_RUNNING : STATES[s]);
    }
}

TEST(reset_and_boot_leave_the_program) {
    for (size_t s = 0; s < STATE_COUNT; s++) {
        robot_core_t robot = robot_in(STATES[s]);
        message_t message = command(RESET);
        assert_int_equal(obey(&robot, &message), ACTION_RESTART);
        message = command(BOOT);
        assert_int_equal(obey(&robot, &message), ACTION_BOOT);
    }
}

TEST(unknown_commands_change_nothing) {
    for (size_t s = 0; s < STATE_COUNT; s++) {
        for (int type = BOOTPGM_PAGE; type <= 0xFF; type++) {
            if (type > BOOTPGM_SIZE && type <= CALIB) continue;
            robot_core_t robot = robot_in(STATES[s]);
            const robot_core_t before = robot;
            const message_t message = command((uint8_t)type);
            assert_int_equal(obey(&robot, &message), ACTION_NONE);
            assert_memory_equal(&robot, &before, sizeof robot);
        }
    }
}

TEST(readuid_turns_left_for_a_bit_that_is_set) {
    for (int bit = 0; bit <= 0xFF; bit++) {
        robot_core_t robot = robot_in(ROBOT_RUNNING);
        message_t message = command(READUID);
        message.data[0] = (uint8_t)bit;
        assert_int_equal(obey(&robot, &message), ACTION_START_MOTORS);
        assert_int_equal(robot.state, ROBOT_MOVING);
        assert_int_equal(robot.motion.left, bit < 16 && UID >> bit & 1 ? TURN_LEFT : 0);
        assert_int_equal(robot.motion.right, 0);
    }
}

static message_t calibration(uint8_t mode) {
    message_t message = {{mode, 0x34, 0x12, 81, 82, 83, 84}, CALIB, 0};
    return message;
}

TEST(calib_tries_the_duties_of_its_mode) {
    static const struct {
        calibration_mode_t mode;
        motion_t motion;
    } TRIALS[] = {{CALIBRATION_UID, {0, 0}},
                  {CALIBRATION_TURN_LEFT, {81, 0}},
                  {CALIBRATION_TURN_RIGHT, {0, 82}},
                  {CALIBRATION_STRAIGHT, {83, 84}}};
    for (size_t i = 0; i < sizeof TRIALS / sizeof *TRIALS; i++) {
        robot_core_t robot = robot_in(ROBOT_IDLE);
        const message_t message = calibration((uint8_t)TRIALS[i].mode);
        assert_int_equal(obey(&robot, &message), ACTION_START_MOTORS);
        assert_int_equal(robot.state, ROBOT_MOVING);
        assert_int_equal(robot.motion.left, TRIALS[i].motion.left);
        assert_int_equal(robot.motion.right, TRIALS[i].motion.right);
    }
}

TEST(an_unknown_mode_of_calib_changes_nothing) {
    for (int mode = CALIBRATION_STRAIGHT + 1; mode <= 0xFF; mode++) {
        for (int is_marked = 0; is_marked <= 1; is_marked++) {
            const bool is_entry =
                mode >= CALIBRATION_GAINS && mode < CALIBRATION_GAINS + GAIN_ENTRIES;
            if (is_marked && is_entry) continue;
            robot_core_t robot = robot_in(ROBOT_MOVING);
            const robot_core_t before = robot;
            message_t message = calibration((uint8_t)mode);
            message.data[CALIB_UID_LOW] = (uint8_t)UID;
            message.data[CALIB_UID_HIGH] = UID >> 8;
            if (is_marked) memcpy(message.data + CALIB_MARK, "KT", 2);
            assert_int_equal(obey(&robot, &message), ACTION_NONE);
            assert_memory_equal(&robot, &before, sizeof robot);
        }
    }
}

TEST(calib_saves_after_a_trial_only) {
    const message_t message = calibration(CALIBRATION_SAVE);
    for (size_t s = 0; s < STATE_COUNT; s++) {
        robot_core_t robot = robot_in(STATES[s]);
        const robot_action_t action = obey(&robot, &message);
        if (STATES[s] == ROBOT_MOVING) {
            assert_int_equal(action, ACTION_SAVE);
            assert_int_equal(robot.state, ROBOT_IDLE);
        } else {
            assert_int_equal(action, ACTION_NONE);
            assert_int_equal(robot.state, STATES[s]);
        }
    }
}

TEST(calib_with_the_mark_is_for_the_robot_of_its_uid_alone) {
    for (int mode = CALIBRATION_SAVE; mode <= CALIBRATION_STRAIGHT; mode++) {
        for (int other = 0; other < 3; other++) {
            const uint16_t uid = UID ^ (other == 1 ? 0x0001 : other == 2 ? 0x0100 : 0);
            robot_core_t robot = robot_in(ROBOT_MOVING);
            robot.motion = (motion_t){9, 9};
            const robot_core_t before = robot;
            message_t message = calibration((uint8_t)mode);
            message.data[CALIB_UID_LOW] = (uint8_t)uid;
            message.data[CALIB_UID_HIGH] = (uint8_t)(uid >> 8);
            memcpy(message.data + CALIB_MARK, "KT", 2);
            const robot_action_t action = obey(&robot, &message);
            if (other == 0) {
                assert_int_equal(action, mode == CALIBRATION_SAVE ? ACTION_SAVE : ACTION_NONE);
                assert_memory_not_equal(&robot, &before, sizeof robot);
            } else {
                assert_int_equal(action, ACTION_NONE);
                assert_memory_equal(&robot, &before, sizeof robot);
            }
        }
    }
}

// One for each entry, and one beyond.
TEST(an_entry_of_the_tables_is_saved_by_the_robot_of_the_uid_alone_and_not_while_it_runs) {
    for (int entry = 0; entry <= GAIN_ENTRIES; entry++) {
        for (size_t s = 0; s < STATE_COUNT; s++) {
            for (int fault = 0; fault < 3; fault++) {
                robot_core_t robot = robot_in(STATES[s]), before = robot;
                message_t message = calibration((uint8_t)(CALIBRATION_GAINS + entry));
                message.data[CALIB_UID_LOW] = (uint8_t)(UID ^ (fault == 1));
                message.data[CALIB_UID_HIGH] = UID >> 8;
                if (fault != 2) memcpy(message.data + CALIB_MARK, "KT", 2);
                const robot_action_t action = obey(&robot, &message);
                const bool waits = STATES[s] == ROBOT_IDLE || STATES[s] == ROBOT_MOVING;
                if (waits && fault == 0 && entry < GAIN_ENTRIES) {
                    assert_int_equal(action, ACTION_SAVE);
                    before.state = ROBOT_IDLE;
                } else {
                    assert_int_equal(action, ACTION_NONE);
                }
                assert_memory_equal(&robot, &before, sizeof robot);
            }
        }
    }
}

TEST(calib_with_half_the_mark_is_for_every_robot) {
    static const char *const MARKS[] = {"K", "\0T", "k", "KK"};
    for (size_t i = 0; i < sizeof MARKS / sizeof *MARKS; i++) {
        robot_core_t robot = robot_in(ROBOT_IDLE);
        message_t message = calibration(CALIBRATION_STRAIGHT);
        memcpy(message.data + CALIB_MARK, MARKS[i], 2);
        assert_int_equal(obey(&robot, &message), ACTION_START_MOTORS);
    }
}

TEST(a_motion_that_is_ordered_again_does_not_kick_again) {
    robot_core_t robot = robot_in(ROBOT_IDLE);
    message_t message = calibration(CALIBRATION_STRAIGHT);
    obey(&robot, &message);
    assert_true(robot_takes_motion(&robot));
    assert_true(robot_keeps_motion(&robot));
    assert_int_equal(obey(&robot, &message), ACTION_NONE);
    assert_false(robot_takes_motion(&robot));
    for (int byte = CALIB_STRAIGHT_LEFT; byte <= CALIB_STRAIGHT_RIGHT; byte++) {
        message.data[byte]++;
        assert_int_equal(obey(&robot, &message), ACTION_NONE);
        assert_false(robot_keeps_motion(&robot));
        assert_true(robot_takes_motion(&robot));
    }
}

TEST(a_motion_ends_with_its_state) {
    robot_core_t robot = robot_in(ROBOT_IDLE);
    const message_t move = calibration(CALIBRATION_STRAIGHT), stop = command(WAKEUP);
    obey(&robot, &move);
    assert_true(robot_takes_motion(&robot));
    obey(&robot, &stop);
    assert_false(robot_keeps_motion(&robot));
    assert_int_equal(obey(&robot, &move), ACTION_START_MOTORS);
    assert_true(robot_takes_motion(&robot));
}

TEST(a_kick_is_for_the_motors_that_are_to_turn) {
    for (int left = 0; left <= 255; left += 51) {
        for (int right = 0; right <= 255; right += 51) {
            const motion_t kick = robot_kick((motion_t){(uint8_t)left, (uint8_t)right});
            assert_int_equal(kick.left, left ? 255 : 0);
            assert_int_equal(kick.right, right ? 255 : 0);
        }
    }
}

static message_t question(void) {
    message_t message = command(BOOTPGM_QUERY);
    message.data[QUERY_FIRST] = ROBOT_QUERY_VITALS;
    message.data[QUERY_UID] = message.data[QUERY_UID + 1] = 0xFF;
    return message;
}

TEST(a_question_is_answered_in_every_state_but_sleep_and_changes_nothing_else) {
    const message_t ask = question();
    for (size_t s = 0; s < STATE_COUNT; s++) {
        robot_core_t robot = robot_in(STATES[s]), before = robot;
        assert_int_equal(obey(&robot, &ask), ACTION_NONE);
        assert_int_equal(robot_answer_matches(&robot.answer), STATES[s] == ROBOT_SLEEPING ? 0 : 1);
        before.answer = robot.answer;
        assert_memory_equal(&robot, &before, sizeof before);
    }
}

TEST(sleep_ends_an_answer_that_is_due) {
    robot_core_t robot = robot_in(ROBOT_RUNNING);
    const message_t ask = question(), sleep = command(SLEEP);
    obey(&robot, &ask);
    obey(&robot, &sleep);
    assert_int_equal(robot_answer_matches(&robot.answer), 0);
}

TEST(the_original_knows_no_question_and_no_mark) {
    message_t ask = command(BOOTPGM_QUERY), calib = command(CALIB), run = command(RUN);
    assert_false(original_knows(&ask));
    assert_true(original_knows(&run));
    calib.data[CALIB_MARK] = CALIB_MARK_LOW;
    calib.data[CALIB_MARK + 1] = CALIB_MARK_HIGH;
    calib.data[CALIB_MODE] = CALIBRATION_STRAIGHT;
    assert_true(original_knows(&calib));
    robot_core_t robot = robot_in(ROBOT_IDLE);
    assert_int_equal(obey(&robot, &calib), ACTION_START_MOTORS);
}

TEST(the_original_looks_when_a_blink_is_over) {
    assert_int_equal(original_looks_after(0), BLINK_PERIOD_CYCLES);
    assert_int_equal(original_looks_after(BLINK_PERIOD_CYCLES - 1), BLINK_PERIOD_CYCLES);
    assert_int_equal(original_looks_after(BLINK_PERIOD_CYCLES), 2 * BLINK_PERIOD_CYCLES);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_robot_begins_in_idle_with_setup_to_come),
        cmocka_unit_test(types_from_0x80_on_are_commands),
        cmocka_unit_test(state_commands_stop_the_motors_whatever_the_robot_does),
        cmocka_unit_test(run_starts_a_robot_that_does_not_run),
        cmocka_unit_test(after_setup_a_robot_runs_unless_a_command_came_meanwhile),
        cmocka_unit_test(reset_and_boot_leave_the_program),
        cmocka_unit_test(unknown_commands_change_nothing),
        cmocka_unit_test(readuid_turns_left_for_a_bit_that_is_set),
        cmocka_unit_test(calib_tries_the_duties_of_its_mode),
        cmocka_unit_test(an_unknown_mode_of_calib_changes_nothing),
        cmocka_unit_test(calib_saves_after_a_trial_only),
        cmocka_unit_test(calib_with_the_mark_is_for_the_robot_of_its_uid_alone),
        cmocka_unit_test(
            an_entry_of_the_tables_is_saved_by_the_robot_of_the_uid_alone_and_not_while_it_runs),
        cmocka_unit_test(calib_with_half_the_mark_is_for_every_robot),
        cmocka_unit_test(a_motion_that_is_ordered_again_does_not_kick_again),
        cmocka_unit_test(a_motion_ends_with_its_state),
        cmocka_unit_test(a_kick_is_for_the_motors_that_are_to_turn),
        cmocka_unit_test(a_question_is_answered_in_every_state_but_sleep_and_changes_nothing_else),
        cmocka_unit_test(sleep_ends_an_answer_that_is_due),
        cmocka_unit_test(the_original_knows_no_question_and_no_mark),
        cmocka_unit_test(the_original_looks_when_a_blink_is_over),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
