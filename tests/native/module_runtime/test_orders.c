#include "core_support.h"
#include "runtime/core/main_loop.h"

TEST(a_module_that_is_switched_on_is_in_init_and_has_nothing_to_answer) {
    const orders_t orders = fresh_orders();
    assert_int_equal(orders.state, STATE_INIT);
    assert_int_equal(main_loop_job(&orders), JOB_BEGIN);
    assert_false(orders_answer_due(&orders));
    assert_int_equal(orders.refused, 0);
}

TEST(module_start_makes_it_idle_or_with_autostart_set_up) {
    orders_t orders = fresh_orders();
    orders_begin(&orders);
    assert_int_equal(orders.state, STATE_IDLE);
    assert_int_equal(main_loop_job(&orders), JOB_BREATHE);
    orders = fresh_orders();
    orders.autostart = true;
    orders_begin(&orders);
    assert_int_equal(orders.state, STATE_SETUP);
}

TEST(an_order_that_came_while_the_lights_were_shown_is_kept) {
    orders_t orders = fresh_orders();
    assert_int_equal(give(&orders, GO_RUN, 0, 0), ORDER_DONE);
    orders_begin(&orders);
    assert_int_equal(orders.state, STATE_RUNNING);
}

TEST(orders_change_the_state) {
    static const struct {
        uint8_t type, state;
        order_t order;
    } CASES[] = {
        {GO_IDLE, STATE_IDLE, ORDER_DONE},
        {GO_SETUP, STATE_SETUP, ORDER_DONE},
        {GO_RUN, STATE_RUNNING, ORDER_DONE},
        {STOP, STATE_IDLE, ORDER_SILENCE},
        {TO_LOADER, STATE_BOOT_LOADER, ORDER_BOOT_LOADER},
        {PAUSE, STATE_WAITING_FOR_PAGE, ORDER_DONE},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        orders_t orders = fresh_orders();
        orders.state = STATE_WAITING_FOR_PAGE;
        assert_int_equal(give(&orders, CASES[i].type, 0, 0), CASES[i].order);
        assert_int_equal(orders.state, CASES[i].state);
    }
}

TEST(a_configuration_waits_for_its_bytes_then_sets_up) {
    orders_t orders = fresh_orders();
    orders.set_up = orders.started = true;
    assert_int_equal(give(&orders, CONFIG_SIZE, 0, 2), ORDER_CONFIG_SIZE);
    assert_int_equal(orders.state, STATE_WAITING_FOR_CONFIGURATION);
    assert_int_equal(main_loop_job(&orders), JOB_NONE);
    assert_false(orders.started);
    const uint8_t data[8] = {CONFIG, 0, 7, 9};
    assert_int_equal(orders_receive(&orders, data, 8, false), ORDER_CONFIGURE);
    assert_int_equal(orders.transfer.config.size, 2);
    assert_int_equal(orders.transfer.config.data[1], 9);
    assert_int_equal(orders.state, STATE_SETUP);
    assert_int_equal(main_loop_job(&orders), JOB_SET_UP);
}

TEST(an_order_gives_up_a_configuration_on_its_way) {
    orders_t orders = fresh_orders();
    (void)give(&orders, CONFIG_SIZE, 0, 12);
    (void)give(&orders, CONFIG, 0, 0);
    (void)give(&orders, GO_SETUP, 0, 0);
    assert_int_equal(give(&orders, CONFIG, 1, 0), ORDER_REFUSED);
    assert_int_equal(orders.state, STATE_SETUP);
}

TEST(setup_runs_once_per_configuration) {
    orders_t orders = fresh_orders();
    (void)give(&orders, GO_SETUP, 0, 0);
    assert_true(orders_begin_setup(&orders));
    orders_end_setup(&orders);
    assert_int_equal(orders.state, STATE_SETUP);
    assert_int_equal(main_loop_job(&orders), JOB_NONE);
    (void)give(&orders, GO_SETUP, 0, 0);
    assert_false(orders_begin_setup(&orders));
}

TEST(with_autostart_run_follows_setup_unless_an_order_came_meanwhile) {
    orders_t orders = fresh_orders();
    orders.autostart = true;
    orders_begin(&orders);
    assert_true(orders_begin_setup(&orders));
    orders_end_setup(&orders);
    assert_int_equal(orders.state, STATE_RUNNING);
    assert_int_equal(main_loop_job(&orders), JOB_START_ROBOTS);
    (void)give(&orders, GO_SETUP, 0, 0);
    assert_int_equal(main_loop_job(&orders), JOB_SET_UP);
    (void)give(&orders, GO_IDLE, 0, 0);
    orders_end_setup(&orders);
    assert_int_equal(orders.state, STATE_IDLE);
}

TEST(robots_are_started_once_until_the_state_was_another_one) {
    orders_t orders = fresh_orders();
    (void)give(&orders, GO_RUN, 0, 0);
    orders.started = true;
    (void)give(&orders, GO_RUN, 0, 0);
    assert_int_equal(main_loop_job(&orders), JOB_LOOP);
    (void)give(&orders, GO_SETUP, 0, 0);
    (void)give(&orders, GO_RUN, 0, 0);
    assert_int_equal(main_loop_job(&orders), JOB_START_ROBOTS);
}

TEST(a_message_for_robots_is_repeated_until_stop_forgets_it) {
    orders_t orders = fresh_orders();
    forward(&orders, 0x83);
    assert_int_equal(orders.state, STATE_SETUP_KILOBOTS);
    assert_int_equal(main_loop_job(&orders), JOB_REPEAT);
    assert_int_equal(give(&orders, STOP, 0, 0), ORDER_SILENCE);
    assert_int_equal(orders.transfer.ir.type, 0);
    assert_int_equal(orders.transfer.ir.data[8], 0);
}

TEST(calibration_is_forwarded_within_its_area_only) {
    enum { CALIB = 0x8A };
    static const calibration_area_t AREA = {1, 2, 4, 5, 7}, OFF = {0, 2, 4, 5, 7};
    for (uint8_t x = 0; x < 10; x++)
        for (uint8_t y = 0; y < 10; y++) {
            const bool inside = x >= 2 && x <= 4 && y >= 5 && y <= 7;
            orders_t orders = fresh_orders();
            orders_begin(&orders);
            assert_int_equal(give_message(&orders, CALIB), ORDER_FORWARD);
            assert_int_equal(orders_forward(&orders, x, y, &AREA), inside);
            assert_int_equal(orders.state, inside ? STATE_SETUP_KILOBOTS : STATE_IDLE);
            assert_true(orders_forward(&orders, x, y, &OFF));
            assert_int_equal(give_message(&orders, 0x88), ORDER_FORWARD);
            assert_true(orders_forward(&orders, x, y, &AREA));
        }
}

TEST(bounds_that_were_never_written_do_not_restrict_calibration) {
    enum { CALIB = 0x8A };
    // The published boot loader writes the first byte alone, as its mark of a valid program.
    static const calibration_area_t AREAS[] = {{1, 0xFF, 0xFF, 0xFF, 0xFF},
                                               {1, 2, 0xFF, 0xFF, 0xFF},
                                               {1, 0xFF, 4, 0xFF, 0xFF},
                                               {1, 0xFF, 0xFF, 5, 0xFF},
                                               {1, 0xFF, 0xFF, 0xFF, 7}};
    for (uint8_t x = 0; x < 10; x++)
        for (uint8_t y = 0; y < 10; y++) {
            const bool inside[] = {true, x >= 2, x <= 4, y >= 5, y <= 7};
            for (uint8_t i = 0; i < 5; i++) {
                orders_t orders = fresh_orders();
                assert_int_equal(give_message(&orders, CALIB), ORDER_FORWARD);
                assert_int_equal(orders_forward(&orders, x, y, &AREAS[i]), inside[i]);
            }
        }
}

TEST(a_page_waits_for_its_chunks_then_goes_out) {
    orders_t orders = fresh_orders();
    assert_int_equal(give(&orders, KILO_PAGES, 0, 2), ORDER_DONE);
    assert_int_equal(give(&orders, KILO_NUMBER, 0, 1), ORDER_DONE);
    assert_int_equal(orders.state, STATE_WAITING_FOR_PAGE);
    assert_int_equal(main_loop_job(&orders), JOB_NONE);
    give_page(&orders, 1);
    assert_int_equal(orders.state, STATE_BOOTLOADING_KILOBOTS);
    assert_int_equal(orders.page_received, 1);
    assert_int_equal(main_loop_job(&orders), JOB_SEND_PAGE);
    orders.page = false;
    assert_int_equal(main_loop_job(&orders), JOB_NONE);
}

TEST(boot_begins_the_laps_of_pages_anew) {
    orders_t orders = fresh_orders();
    orders.page_cell = 3;
    orders.page_received = 5;
    forward(&orders, 0x83);
    assert_int_equal(orders.page_cell, 3);
    forward(&orders, 0x80);
    assert_int_equal(orders.page_cell, 0);
    assert_int_equal(orders.page_received, 0);
}

TEST(an_announcement_behind_some_pages_ends_their_lap) {
    orders_t orders = fresh_orders();
    (void)give(&orders, KILO_PAGES, 0, 9);
    assert_int_equal(orders.page_cell, 0);
    for (uint8_t lap = 1; lap < 9; lap++) {
        give_page(&orders, 7);
        give_page(&orders, 2);
        assert_int_equal(orders.page_received, 2);
        assert_int_equal(give(&orders, KILO_PAGES, 0, 9), ORDER_DONE);
        assert_int_equal(orders.page_received, 0);
        assert_int_equal(orders.page_cell, lap % 4);
        assert_int_equal(give(&orders, KILO_PAGES, 0, 9), ORDER_DONE);
        assert_int_equal(orders.page_cell, lap % 4);
    }
    // The check before it, and a number that cannot be, end nothing.
    give_page(&orders, 7);
    (void)give(&orders, KILO_PAGES, 1, 9);
    (void)give(&orders, KILO_PAGES, 0, 221);
    assert_int_equal(orders.page_received, 1);
}

TEST(a_question_goes_to_the_robots_in_every_state_but_running) {
    for (uint8_t state = STATE_INIT; state < STATE_BOOT_LOADER; state++) {
        orders_t orders = fresh_orders();
        orders.state = state;
        assert_int_equal(give_question(&orders), ORDER_DONE);
        const bool asks = state != STATE_INIT && state != STATE_RUNNING;
        assert_int_equal(main_loop_job(&orders) == JOB_ASK_ROBOTS, asks);
        // A message that it repeats would drown the answers.
        assert_int_equal(orders.state, state == STATE_SETUP_KILOBOTS ? STATE_IDLE : state);
        assert_int_equal(orders.refused, 0);
    }
}

TEST(a_question_that_came_while_the_lights_were_shown_is_kept) {
    orders_t orders = fresh_orders();
    (void)give_question(&orders);
    orders_begin(&orders);
    assert_int_equal(main_loop_job(&orders), JOB_ASK_ROBOTS);
}

TEST(run_and_the_boot_loader_drop_a_question_that_has_not_gone_out) {
    const uint8_t types[] = {GO_RUN, TO_LOADER};
    for (uint8_t i = 0; i < 2; i++) {
        orders_t orders = fresh_orders();
        orders.state = STATE_IDLE;
        (void)give_question(&orders);
        (void)give(&orders, types[i], 0, 0);
        assert_int_not_equal(main_loop_job(&orders), JOB_ASK_ROBOTS);
        (void)give(&orders, GO_IDLE, 0, 0);
        assert_int_equal(main_loop_job(&orders), JOB_BREATHE);
    }
}

TEST(an_answer_of_a_robot_is_due_to_the_host_until_it_is_taken) {
    const message_t answer = {{0}, 0x8D, 0};
    orders_t orders = fresh_orders();
    uint8_t frame[ROBOT_REPORT_BYTES];
    assert_true(robot_reports_add(&orders.reports, &answer, 0));
    assert_true(orders_answer_due(&orders));
    assert_true(robot_reports_take(&orders.reports, frame));
    assert_false(orders_answer_due(&orders));
}

TEST(polls_and_parts_of_the_health_wait_until_they_are_taken) {
    orders_t orders = fresh_orders();
    const uint8_t poll[1] = {POLL}, second_part[2] = {HEALTH, 1};
    assert_int_equal(orders_receive(&orders, poll, 1, false), ORDER_DONE);
    assert_true(orders_answer_due(&orders));
    assert_true(orders_take_poll(&orders));
    assert_false(orders_take_poll(&orders));
    assert_false(orders_answer_due(&orders));
    assert_int_equal(orders_receive(&orders, second_part, 2, false), ORDER_DONE);
    assert_true(orders_answer_due(&orders));
    assert_false(orders_take_health(&orders, 0));
    assert_true(orders_take_health(&orders, 1));
    assert_false(orders_answer_due(&orders));
}

TEST(what_is_no_order_is_refused_and_counted_up_to_255) {
    orders_t orders = fresh_orders();
    const uint8_t idle[8] = {GO_IDLE}, health[2] = {HEALTH, 2};
    assert_int_equal(orders_receive(&orders, idle, 8, true), ORDER_REFUSED);
    assert_int_equal(orders_receive(&orders, idle, 0, false), ORDER_REFUSED);
    assert_int_equal(orders_receive(&orders, health, 2, false), ORDER_REFUSED);
    assert_int_equal(orders_receive(&orders, health, 1, false), ORDER_REFUSED);
    assert_int_equal(give(&orders, CONFIG_SIZE, 0, 49), ORDER_REFUSED);
    assert_int_equal(orders.refused, 5);
    assert_int_equal(orders.state, STATE_INIT);
    orders_count_refused(&orders, 249);
    assert_int_equal(orders.refused, 254);
    orders_count_refused(&orders, 1);
    orders_count_refused(&orders, 1);
    orders_count_refused(&orders, 200);
    assert_int_equal(orders.refused, 255);
}

TEST(the_program_gets_every_other_frame_and_the_pages_of_its_successor) {
    static const uint8_t OWN[] = {OWN_PAGE,       OWN_PAGES,       OWN_NUMBER,
                                  OWN_PAGE + OLD, OWN_PAGES + OLD, OWN_NUMBER + OLD};
    for (int type = 0; type < 256; type++) {
        const bool is_own = memchr(OWN, type, sizeof OWN) != NULL;
        assert_int_equal(orders_is_own_program((uint8_t)type), is_own);
        const bool is_free = type == 0x00 || type == 0x0A || type == 0x12 || type > POLL;
        if (is_own || (is_free && type != ASK)) {
            orders_t orders = fresh_orders();
            assert_int_equal(give(&orders, (uint8_t)type, 0, 0), ORDER_HAND_OVER);
            assert_int_equal(orders.state, STATE_INIT);
        }
    }
}

TEST(the_boot_loader_is_left_by_four_orders) {
    static const uint8_t LEAVES[] = {GO_IDLE, GO_SETUP, GO_RUN, GO_IDLE + OLD};
    for (int type = 0; type < 256; type++)
        assert_int_equal(orders_leaves_boot_loader((uint8_t)type),
                         memchr(LEAVES, type, sizeof LEAVES) != NULL);
    orders_t orders = fresh_orders();
    orders.state = STATE_BOOT_LOADER;
    assert_int_equal(main_loop_job(&orders), JOB_NONE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_module_that_is_switched_on_is_in_init_and_has_nothing_to_answer),
        cmocka_unit_test(module_start_makes_it_idle_or_with_autostart_set_up),
        cmocka_unit_test(an_order_that_came_while_the_lights_were_shown_is_kept),
        cmocka_unit_test(orders_change_the_state),
        cmocka_unit_test(a_configuration_waits_for_its_bytes_then_sets_up),
        cmocka_unit_test(an_order_gives_up_a_configuration_on_its_way),
        cmocka_unit_test(setup_runs_once_per_configuration),
        cmocka_unit_test(with_autostart_run_follows_setup_unless_an_order_came_meanwhile),
        cmocka_unit_test(robots_are_started_once_until_the_state_was_another_one),
        cmocka_unit_test(a_message_for_robots_is_repeated_until_stop_forgets_it),
        cmocka_unit_test(calibration_is_forwarded_within_its_area_only),
        cmocka_unit_test(bounds_that_were_never_written_do_not_restrict_calibration),
        cmocka_unit_test(a_page_waits_for_its_chunks_then_goes_out),
        cmocka_unit_test(boot_begins_the_laps_of_pages_anew),
        cmocka_unit_test(an_announcement_behind_some_pages_ends_their_lap),
        cmocka_unit_test(a_question_goes_to_the_robots_in_every_state_but_running),
        cmocka_unit_test(a_question_that_came_while_the_lights_were_shown_is_kept),
        cmocka_unit_test(run_and_the_boot_loader_drop_a_question_that_has_not_gone_out),
        cmocka_unit_test(an_answer_of_a_robot_is_due_to_the_host_until_it_is_taken),
        cmocka_unit_test(polls_and_parts_of_the_health_wait_until_they_are_taken),
        cmocka_unit_test(what_is_no_order_is_refused_and_counted_up_to_255),
        cmocka_unit_test(the_program_gets_every_other_frame_and_the_pages_of_its_successor),
        cmocka_unit_test(the_boot_loader_is_left_by_four_orders),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
