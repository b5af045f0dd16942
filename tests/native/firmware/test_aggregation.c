/// The glue, on a Kilobot API that only remembers. Each test is a robot switched on anew: a process
/// of its own, since the program's variables are set up once in a life.
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fake_kilolib.h"
#include "support.h"
#include "wire.h"

int robot_main(void);

static void receive(message_t message) {
    distance_measurement_t distance = {0, 0};
    kilo_message_rx(&message, &distance);
}

static void cell(uint8_t site, uint8_t flags) {
    message_t message = {.type = WIRE_TYPE_CELL};
    wire_put_cell(message.data, (wire_cell_t){site, flags});
    receive(message);
}

static void signal_of(uint16_t uid) {
    message_t message = {.type = WIRE_TYPE_SIGNAL};
    wire_put_signal(message.data, uid);
    receive(message);
}

static void config(uint16_t first, uint16_t last, uint8_t key, uint32_t value) {
    message_t message = {.type = WIRE_TYPE_CONFIG};
    wire_put_config(message.data, (wire_config_t){first, last, key, value});
    receive(message);
}

static void configure(uint8_t key, uint32_t value) { config(0, 0xFFFF, key, value); }

static void switch_on(void) {
    fake_reset();
    assert_int_equal(robot_main(), 0);
}

static void tick(void) {
    kilo_ticks++;
    fake_loop();
    fake_loop();  // as on a robot, more than once in a tick
}

static void ticks(int count) {
    for (int i = 0; i < count; i++) tick();
}

static void assert_motors(uint8_t left, uint8_t right) {
    assert_int_equal(fake.left, left);
    assert_int_equal(fake.right, right);
}

static void assert_straight(void) { assert_motors(67, 68); }

// A robot that entered site 1 at once and rests there, and does not leave.
static void switch_on_and_rest(void) {
    switch_on();
    configure(WIRE_KEY_ENTRY_TICKS, 0);
    configure(WIRE_KEY_ALPHA, 0);
    cell(1, 0);
    fake_setup();
    fake_loop();
}

TEST(the_robot_starts_straight_on_with_a_push_and_its_led_off) {
    switch_on();
    fake_setup();
    assert_int_equal(fake.rand_hard_calls, 4);
    fake_loop();
    assert_straight();
    assert_int_equal(fake.spinup_calls, 1);
    assert_int_equal(fake.colour, RGB(0, 0, 0));
}

TEST(motors_and_led_are_touched_only_when_they_change) {
    switch_on();
    fake_setup();
    ticks(150);
    assert_int_equal(fake.set_motors_calls, 1);
    assert_int_equal(fake.set_color_calls, 1);
}

TEST(a_turn_drives_one_motor_and_needs_a_push_only_for_a_motor_that_stood_still) {
    switch_on();
    configure(WIRE_KEY_STRAIGHT_TICKS, 10);
    fake_setup();
    int left = 0;
    int right = 0;
    fake_robot_t before = fake;
    for (int i = 0; i < 20000; i++) {
        tick();
        if (fake.set_motors_calls == before.set_motors_calls) continue;
        const bool starts =
            (before.left == 0 && fake.left > 0) || (before.right == 0 && fake.right > 0);
        assert_int_equal(fake.spinup_calls - before.spinup_calls, starts);
        if (fake.left > 0 && fake.right > 0) {
            assert_straight();
        } else if (fake.left > 0) {
            assert_motors(65, 0);
            left++;
        } else {
            assert_motors(0, 66);
            right++;
        }
        before = fake;
    }
    assert_true(left > 100);
    assert_true(right > 100);
}

TEST(a_motor_that_runs_at_full_power_needs_no_push) {
    switch_on();
    kilo_straight_left = kilo_straight_right = kilo_turn_left = kilo_turn_right = 255;
    fake_setup();
    ticks(3000);
    assert_true(fake.set_motors_calls > 10);
    assert_int_equal(fake.spinup_calls, 0);
}

TEST(the_led_shows_the_state) {
    switch_on();
    configure(WIRE_KEY_ENTRY_TICKS, 10);
    configure(WIRE_KEY_ALPHA, 0xFFFFFFFF);
    configure(WIRE_KEY_FIRST_LEAVE, 1);
    fake_setup();
    cell(0, 0);
    tick();
    assert_int_equal(fake.colour, RGB(0, 0, 0));
    cell(0, WIRE_CELL_OBSTACLE);
    tick();
    assert_int_equal(fake.colour, RGB(1, 0, 0));
    cell(1, 0);
    tick();
    assert_int_equal(fake.colour, RGB(1, 1, 1));
    ticks(10);
    assert_int_equal(fake.colour, RGB(3, 3, 3));
    assert_motors(0, 0);
    ticks(76);
    assert_int_equal(fake.colour, RGB(0, 1, 0));
    cell(1, WIRE_CELL_OBSTACLE);  // avoiding shows in the random walk only
    tick();
    assert_int_equal(fake.colour, RGB(0, 1, 0));
}

TEST(a_resting_robot_signals_its_uid) {
    switch_on_and_rest();
    const message_t *message = kilo_message_tx();
    assert_non_null(message);
    assert_int_equal(message->type, WIRE_TYPE_SIGNAL);
    assert_int_equal(wire_get_signal(message->data), 42);
    assert_int_equal(message->crc, message_crc(message));
}

TEST(a_walking_robot_is_silent) {
    switch_on();
    assert_null(kilo_message_tx());
    fake_setup();
    ticks(10);
    assert_null(kilo_message_tx());
}

TEST(config_is_for_the_robots_in_its_range) {
    switch_on();
    config(43, 50, WIRE_KEY_STRAIGHT_TICKS, 10);
    config(1, 41, WIRE_KEY_STRAIGHT_TICKS, 10);
    config(42, 42, WIRE_KEY_STRAIGHT_TICKS, 20);
    fake_setup();
    ticks(19);
    assert_straight();
    tick();
    assert_true(fake.left == 0 || fake.right == 0);
}

TEST(config_is_refused_once_the_robot_has_run) {
    switch_on();
    fake_setup();
    configure(WIRE_KEY_STRAIGHT_TICKS, 10);
    ticks(150);
    assert_straight();
}

TEST(config_out_of_range_changes_nothing) {
    switch_on();
    configure(WIRE_KEY_STRAIGHT_TICKS, 0);
    fake_setup();
    ticks(150);
    assert_straight();
}

TEST(signals_keep_a_robot_at_rest) {
    switch_on();
    configure(WIRE_KEY_ENTRY_TICKS, 0);
    configure(WIRE_KEY_ALPHA, 65536);
    configure(WIRE_KEY_BETA, 0xFFFFFFFF);
    cell(1, 0);
    signal_of(7);  // before it runs a robot counts no neighbour
    fake_setup();
    for (int i = 0; i < 500; i++) {
        signal_of(7);
        tick();
    }
    assert_int_equal(fake.colour, RGB(3, 3, 3));
    ticks(77 + 76);  // silence, for longer than the window
    assert_int_equal(fake.colour, RGB(0, 1, 0));
}

TEST(messages_of_other_types_and_unknown_flags_are_ignored) {
    switch_on();
    fake_setup();
    cell(0, 0xFC);
    receive((message_t){.type = NORMAL, .data = {1, WIRE_CELL_OBSTACLE}});
    receive((message_t){.type = 0x7F, .data = {1, WIRE_CELL_OBSTACLE}});
    ticks(10);
    assert_int_equal(fake.colour, RGB(0, 0, 0));
}

// RUN after a pause finds motors and LED switched off, and calls loop() only.
TEST(after_a_pause_the_robot_goes_on_where_it_was) {
    switch_on_and_rest();
    fake.colour = RGB(0, 1, 0);  // a paused robot blinks
    kilo_ticks += 1000;
    fake_loop();
    assert_int_equal(fake.colour, RGB(3, 3, 3));
}

TEST(after_a_pause_a_walking_robot_walks) {
    switch_on();
    fake_setup();
    ticks(20);
    fake.left = fake.right = 0;
    fake.spinup_calls = 0;
    kilo_ticks += 10;
    fake_loop();
    assert_straight();
    assert_int_equal(fake.spinup_calls, 1);
}

TEST(ticks_may_be_missed) {
    switch_on();
    fake_setup();
    for (int i = 0; i < 500; i++) {
        kilo_ticks += (uint32_t)(i % 4);
        fake_loop();
    }
    assert_true(fake.set_motors_calls > 1);
}

// The message that the robot would send now, if the medium took it.
static message_t *ask(void) { return kilo_message_tx(); }

static wire_tracking_t report_in(const message_t *message) {
    assert_non_null(message);
    assert_int_equal(message->type, WIRE_TYPE_TRACKING);
    assert_int_equal(message->crc, message_crc(message));
    return wire_get_tracking(message->data);
}

TEST(a_robot_that_shall_not_report_does_not) {
    switch_on();
    fake_setup();
    for (int i = 0; i < 500; i++) {
        tick();
        assert_null(ask());
    }
}

TEST(a_report_says_who_and_how_until_it_is_sent) {
    switch_on();
    configure(WIRE_KEY_TRACKING_TICKS, 61);
    cell(0, WIRE_CELL_WALL);
    fake_setup();
    ticks(41);  // its uid is 42
    assert_null(ask());
    cell(3, 0);
    tick();
    const wire_tracking_t report = report_in(ask());
    assert_int_equal(report.uid, 42);
    assert_int_equal(report.led, fake.colour);
    assert_int_equal(report.number, 1);
    tick();
    assert_ptr_equal(ask(), ask());  // the channel was busy: tried again
    kilo_message_tx_success();
    assert_null(ask());
    ticks(60);
    assert_int_equal(report_in(ask()).number, 2);
    assert_int_equal(report_in(ask()).cell.site, 3);
}

TEST(a_report_is_left_behind_by_the_next) {
    switch_on();
    configure(WIRE_KEY_TRACKING_TICKS, 10);
    fake_setup();
    ticks(35);
    assert_int_equal(report_in(ask()).number, 4);
}

TEST(a_resting_robot_signals_between_reports) {
    switch_on_and_rest();
    ticks(2);
    assert_int_equal(ask()->type, WIRE_TYPE_SIGNAL);
    kilo_message_tx_success();
    assert_int_equal(ask()->type, WIRE_TYPE_SIGNAL);
}

TEST(a_report_takes_one_turn_of_the_signals) {
    switch_on();
    configure(WIRE_KEY_TRACKING_TICKS, 61);
    configure(WIRE_KEY_ENTRY_TICKS, 0);
    configure(WIRE_KEY_ALPHA, 0);
    cell(1, 0);
    fake_setup();
    ticks(44);
    assert_int_equal(report_in(ask()).led, RGB(3, 3, 3));
    kilo_message_tx_success();
    assert_int_equal(ask()->type, WIRE_TYPE_SIGNAL);
    kilo_message_tx_success();
    assert_int_equal(ask()->type, WIRE_TYPE_SIGNAL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_robot_that_shall_not_report_does_not),
        cmocka_unit_test(a_report_says_who_and_how_until_it_is_sent),
        cmocka_unit_test(a_report_is_left_behind_by_the_next),
        cmocka_unit_test(a_resting_robot_signals_between_reports),
        cmocka_unit_test(a_report_takes_one_turn_of_the_signals),
        cmocka_unit_test(the_robot_starts_straight_on_with_a_push_and_its_led_off),
        cmocka_unit_test(motors_and_led_are_touched_only_when_they_change),
        cmocka_unit_test(
            a_turn_drives_one_motor_and_needs_a_push_only_for_a_motor_that_stood_still),
        cmocka_unit_test(a_motor_that_runs_at_full_power_needs_no_push),
        cmocka_unit_test(the_led_shows_the_state),
        cmocka_unit_test(a_resting_robot_signals_its_uid),
        cmocka_unit_test(a_walking_robot_is_silent),
        cmocka_unit_test(config_is_for_the_robots_in_its_range),
        cmocka_unit_test(config_is_refused_once_the_robot_has_run),
        cmocka_unit_test(config_out_of_range_changes_nothing),
        cmocka_unit_test(signals_keep_a_robot_at_rest),
        cmocka_unit_test(messages_of_other_types_and_unknown_flags_are_ignored),
        cmocka_unit_test(after_a_pause_the_robot_goes_on_where_it_was),
        cmocka_unit_test(after_a_pause_a_walking_robot_walks),
        cmocka_unit_test(ticks_may_be_missed),
    };
    int failed = 0;
    for (size_t i = 0; i < sizeof tests / sizeof *tests; i++) {
        const struct CMUnitTest one[] = {tests[i]};
        fflush(stdout);
        if (fork() == 0) exit(cmocka_run_group_tests(one, NULL, NULL));
        int status = 0;
        wait(&status);
        failed += status != 0;
    }
    return failed != 0;
}
