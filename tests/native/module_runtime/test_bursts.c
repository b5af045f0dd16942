#include "core_support.h"
#include "runtime/core/bursts.h"

enum { RED_LIGHT = 1, GREEN_LIGHT = 2, YELLOW_LIGHT = 3, BLUE_LIGHT = 4, MAGENTA_LIGHT = 5 };
enum { ALL_CELLS = 0x0F, FRAMES_MAX = 64 };

typedef struct {
    burst_frame_t frames[FRAMES_MAX];
    burst_light_t lights[FRAMES_MAX + 1];  // before each frame, then before the end
    uint8_t count;
} played_t;

static played_t play(orders_t *orders) {
    played_t played;
    burst_t burst;
    memset(&played, 0, sizeof played);
    burst_begin(&burst, orders, main_loop_job(orders));
    for (;;) {
        played.lights[played.count] = burst_light(&burst, orders);
        if (!burst_next(&burst, orders, &played.frames[played.count])) break;
        played.count++;
    }
    burst_end(&burst, orders);
    assert_int_equal(burst.job, JOB_NONE);
    return played;
}

static void assert_light(burst_light_t light, uint8_t cells, uint8_t color) {
    assert_int_equal(light.cells, cells);
    if (cells != 0) assert_int_equal(light.color, color);
}

TEST(a_forwarded_message_goes_out_once_by_each_cell_then_its_light_is_shown) {
    orders_t orders = fresh_orders();
    forward(&orders, 0x83);
    const played_t played = play(&orders);
    assert_int_equal(played.count, 4);
    for (uint8_t i = 0; i < 4; i++) {
        assert_int_equal(played.frames[i].cell, i);
        assert_int_equal(played.frames[i].message.type, 0x83);
        assert_int_equal(played.frames[i].message.crc, 0);
        for (uint8_t byte = 0; byte < 9; byte++)
            assert_int_equal(played.frames[i].message.data[byte], byte + 1);
        assert_light(played.lights[i], 0, 0);
    }
    assert_light(played.lights[4], ALL_CELLS, GREEN_LIGHT);
    assert_int_equal(main_loop_job(&orders), JOB_REPEAT);
}

TEST(a_round_ends_without_light_once_another_state_came) {
    orders_t orders = fresh_orders();
    burst_t burst;
    burst_frame_t frame;
    forward(&orders, 0x83);
    burst_begin(&burst, &orders, JOB_REPEAT);
    assert_true(burst_next(&burst, &orders, &frame));
    (void)give(&orders, STOP, 0, 0);
    for (uint8_t i = 1; i < 4; i++) {
        assert_true(burst_next(&burst, &orders, &frame));
        assert_int_equal(frame.message.type, 0x83);
    }
    assert_light(burst_light(&burst, &orders), 0, 0);
    assert_false(burst_next(&burst, &orders, &frame));
}

TEST(run_goes_out_ten_times_by_each_cell_and_the_robots_count_as_started) {
    orders_t orders = fresh_orders();
    (void)give(&orders, GO_RUN, 0, 0);
    const played_t played = play(&orders);
    assert_int_equal(played.count, 40);
    for (uint8_t i = 0; i < 40; i++) {
        assert_int_equal(played.frames[i].cell, i % 4);
        assert_int_equal(played.frames[i].message.type, 0x88);
    }
    assert_light(played.lights[0], ALL_CELLS, MAGENTA_LIGHT);
    assert_light(played.lights[1], 0, 0);
    assert_light(played.lights[40], 0, 0);
    assert_true(orders.started);
}

TEST(run_stops_between_two_rounds_when_the_state_changes) {
    orders_t orders = fresh_orders();
    burst_t burst;
    burst_frame_t frame;
    (void)give(&orders, GO_RUN, 0, 0);
    burst_begin(&burst, &orders, JOB_START_ROBOTS);
    for (uint8_t i = 0; i < 6; i++) assert_true(burst_next(&burst, &orders, &frame));
    (void)give(&orders, GO_IDLE, 0, 0);
    assert_true(burst_next(&burst, &orders, &frame));
    assert_true(burst_next(&burst, &orders, &frame));
    assert_false(burst_next(&burst, &orders, &frame));
    burst_end(&burst, &orders);
    assert_false(orders.started);
}

static void assert_page(const burst_frame_t *frames, uint8_t page, uint8_t cell) {
    for (uint8_t chunk = 0; chunk < 22; chunk++) {
        const message_t *message = &frames[chunk].message;
        assert_int_equal(frames[chunk].cell, cell);
        assert_int_equal(message->type, 0x81);
        assert_int_equal(message->data[0], page);
        assert_int_equal(message->data[1], 3 * chunk);
        for (uint8_t i = 0; i < 6; i++) {
            const bool is_beyond = 6 * chunk + i >= 128;
            assert_int_equal(message->data[2 + i], is_beyond ? 0 : (uint8_t)(page + 6 * chunk + i));
        }
        assert_int_equal(message->data[8], 0);
    }
}

TEST(pages_go_out_by_one_cell_a_lap_and_the_first_one_says_how_many) {
    orders_t orders = fresh_orders();
    (void)give(&orders, KILO_PAGES, 0, 3);
    for (uint8_t lap = 0; lap < 6; lap++) {
        for (uint8_t page = 0; page < 3; page++) {
            const uint8_t cell = lap % 4, before = page == 0 ? 1 : 0;
            give_page(&orders, page);
            const played_t played = play(&orders);
            assert_int_equal(played.count, 22 + before);
            assert_page(played.frames + before, page, cell);
            if (page == 0) {
                assert_int_equal(played.frames[0].cell, cell);
                assert_int_equal(played.frames[0].message.type, 0x82);
                assert_int_equal(played.frames[0].message.data[0], 3);
            }
            assert_light(played.lights[0], 0, 0);
            assert_light(played.lights[1], page == 0 ? ALL_CELLS : 0, 0);
            const uint8_t own = (uint8_t)(1 << cell);
            assert_light(played.lights[played.count], page == 2 ? ALL_CELLS : own,
                         page == 2   ? 0
                         : page == 0 ? BLUE_LIGHT
                                     : GREEN_LIGHT);
            assert_false(orders.page);
        }
    }
}

// A receiver that lost its place in a frame is lost to all that follow it without a gap.
TEST(it_is_dark_between_the_frames_of_a_page_and_of_no_other_burst) {
    orders_t orders = fresh_orders();
    burst_t burst;
    burst_frame_t frame;
    (void)give(&orders, KILO_PAGES, 0, 3);
    give_page(&orders, 0);
    burst_begin(&burst, &orders, JOB_SEND_PAGE);
    for (uint8_t i = 0; i < 23; i++) {
        assert_true(burst_next(&burst, &orders, &frame));
        assert_int_equal(burst_pauses(&burst), i < 22);
    }
    burst_end(&burst, &orders);
    assert_false(burst_pauses(&burst));
    (void)give_question(&orders);
    burst_begin(&burst, &orders, JOB_ASK_ROBOTS);
    while (burst_next(&burst, &orders, &frame)) assert_false(burst_pauses(&burst));
}

TEST(the_next_page_may_come_in_while_one_goes_out) {
    orders_t orders = fresh_orders();
    burst_t burst;
    burst_frame_t frames[23];
    (void)give(&orders, KILO_PAGES, 0, 3);
    give_page(&orders, 0);
    burst_begin(&burst, &orders, JOB_SEND_PAGE);
    give_page(&orders, 1);
    for (uint8_t i = 0; i < 23; i++) assert_true(burst_next(&burst, &orders, &frames[i]));
    assert_page(frames + 1, 0, 0);
    assert_light(burst_light(&burst, &orders), 1, BLUE_LIGHT);
    burst_end(&burst, &orders);
    assert_int_equal(orders.page_received, 2);
    assert_int_equal(main_loop_job(&orders), JOB_SEND_PAGE);
}

TEST(a_checked_program_is_announced_with_its_crc_and_id) {
    orders_t orders = fresh_orders();
    const uint8_t check[8] = {KILO_PAGES, 1, 0x34, 0x12, 0xEF, 0xBE, 0xAD, 0xDE};
    (void)orders_receive(&orders, check, 8, false);
    (void)give(&orders, KILO_PAGES, 0, 3);
    give_page(&orders, 1);
    const played_t played = play(&orders);
    const uint8_t expected[9] = {3, 'K', 'T', 0x34, 0x12, 0xEF, 0xBE, 0xAD, 0xDE};
    assert_int_equal(played.frames[0].message.type, 0x82);
    assert_memory_equal(played.frames[0].message.data, expected, 9);
    assert_page(played.frames + 1, 1, 0);
}

TEST(an_unchecked_program_is_announced_by_its_pages_alone) {
    orders_t orders = fresh_orders();
    (void)give(&orders, KILO_PAGES, 0, 3);
    give_page(&orders, 1);
    const played_t played = play(&orders);
    const uint8_t expected[9] = {3};
    assert_memory_equal(played.frames[0].message.data, expected, 9);
}

TEST(a_lap_of_some_pages_goes_out_by_the_next_cell_once_it_is_announced_again) {
    orders_t orders = fresh_orders();
    for (uint8_t lap = 0; lap < 6; lap++) {
        (void)give(&orders, KILO_PAGES, 0, 3);
        give_page(&orders, 2);
        const played_t played = play(&orders);
        assert_int_equal(played.count, 23);
        assert_int_equal(played.frames[0].message.type, 0x82);
        assert_page(played.frames + 1, 2, lap % 4);
    }
}

// The host's next lap may be announced before the last page has gone out.
TEST(an_announcement_during_the_last_page_of_a_lap_ends_it_once) {
    for (uint8_t pages = 1; pages < 4; pages++) {
        orders_t orders = fresh_orders();
        burst_t burst;
        (void)give(&orders, KILO_PAGES, 0, pages);
        give_page(&orders, 0);
        burst_begin(&burst, &orders, JOB_SEND_PAGE);
        (void)give(&orders, KILO_PAGES, 0, pages);
        burst_end(&burst, &orders);
        assert_int_equal(orders.page_cell, 1);
        assert_int_equal(orders.page_received, 0);
    }
}

TEST(a_question_goes_out_once_by_each_cell_and_changes_no_light) {
    orders_t orders = fresh_orders();
    forward(&orders, 0x83);
    (void)give_question(&orders);
    const played_t played = play(&orders);
    const uint8_t expected[9] = {0xE1, 4, 7, 0xFF, 0xFF};
    assert_int_equal(played.count, 4);
    for (uint8_t i = 0; i < 4; i++) {
        assert_int_equal(played.frames[i].cell, i);
        assert_int_equal(played.frames[i].message.type, 0x8C);
        assert_memory_equal(played.frames[i].message.data, expected, 9);
        assert_light(played.lights[i], 0, 0);
    }
    assert_light(played.lights[4], 0, 0);
    assert_int_equal(main_loop_job(&orders), JOB_BREATHE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_forwarded_message_goes_out_once_by_each_cell_then_its_light_is_shown),
        cmocka_unit_test(a_round_ends_without_light_once_another_state_came),
        cmocka_unit_test(run_goes_out_ten_times_by_each_cell_and_the_robots_count_as_started),
        cmocka_unit_test(run_stops_between_two_rounds_when_the_state_changes),
        cmocka_unit_test(pages_go_out_by_one_cell_a_lap_and_the_first_one_says_how_many),
        cmocka_unit_test(it_is_dark_between_the_frames_of_a_page_and_of_no_other_burst),
        cmocka_unit_test(the_next_page_may_come_in_while_one_goes_out),
        cmocka_unit_test(a_checked_program_is_announced_with_its_crc_and_id),
        cmocka_unit_test(an_unchecked_program_is_announced_by_its_pages_alone),
        cmocka_unit_test(a_lap_of_some_pages_goes_out_by_the_next_cell_once_it_is_announced_again),
        cmocka_unit_test(an_announcement_during_the_last_page_of_a_lap_ends_it_once),
        cmocka_unit_test(a_question_goes_out_once_by_each_cell_and_changes_no_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
