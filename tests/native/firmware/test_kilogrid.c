/// The helpers for Kilogrid robot programs, on a Kilobot API that only remembers.
#include <kilob_random_walk.h>
#include <kilob_tracking.h>
#include <stdlib.h>
#include <string.h>

#include "fake_kilolib.h"
#include "support.h"

volatile uint8_t DDRB, DDRD;

static void receive(uint8_t type) {
    message_t message = {.type = type};
    distance_measurement_t distance = {0, 0};
    kilo_message_rx(&message, &distance);
}

static int passed_on;
static void count(IR_message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    passed_on++;
}

static void assert_motors(uint8_t left, uint8_t right) {
    assert_int_equal(fake.left, left);
    assert_int_equal(fake.right, right);
}

TEST(the_hosts_motion_commands_switch_the_motors_on_and_the_rest_is_passed_on) {
    fake_reset();
    kilo_init();
    utils_init();
    receive(NORMAL);  // nothing takes it yet
    utils_message_rx = count;
    passed_on = 0;
    receive(GO_STRAIGHT);
    assert_motors(kilo_straight_left, kilo_straight_right);
    assert_int_equal(DDRB, 8);
    assert_int_equal(DDRD, 8);
    DDRB = 0;
    receive(TURN_LEFT);
    assert_motors(kilo_turn_left, 0);
    receive(TURN_RIGHT);
    assert_motors(0, kilo_turn_right);
    assert_int_equal(DDRB, 0);  // once is enough
    assert_int_equal(passed_on, 0);
    receive(NORMAL);
    receive(TRACKING);
    assert_int_equal(passed_on, 2);
}

TEST(a_robot_is_pushed_only_when_it_changes_its_direction) {
    fake_reset();
    init_motors();
    assert_int_equal(get_direction(), UNDEFINED);
    move_straight();
    const int calls = fake.set_motors_calls;
    move_straight();
    assert_int_equal(fake.set_motors_calls, calls);
    assert_int_equal(get_direction(), STRAIGHT);
    turn_left();
    assert_int_equal(fake.set_motors_calls, calls + 2);
    assert_int_equal(fake.delayed_ms, 40);
    assert_int_equal(get_direction(), LEFT);
    stop();
    assert_motors(0, 0);
    assert_int_equal(get_direction(), UNDEFINED);
}

TEST(motor_values_are_capped) {
    fake_reset();
    safe_set_motors(255, 99);
    assert_motors(100, 99);
}

TEST(messages_go_out_in_order_with_their_checksum_until_they_are_sent) {
    fake_reset();
    kilob_messaging_init();
    assert_null(kilo_message_tx());
    kilo_message_tx_success();  // of nothing
    for (uint8_t i = 0; i < 3; i++) {
        IR_message_t *message = kilob_message_send();
        message->type = (uint8_t)(0x20 + i);
        memset(message->data, i, sizeof message->data);
    }
    assert_null(kilob_message_send());
    for (uint8_t i = 0; i < 3; i++) {
        const message_t *message = kilo_message_tx();
        assert_int_equal(message->type, 0x20 + i);
        assert_int_equal(message->crc, message_crc(message));
        assert_ptr_equal(kilo_message_tx(), message);  // not sent yet
        kilo_message_tx_success();
        assert_non_null(kilob_message_send());
        kilob_messaging_init();
        for (uint8_t rest = (uint8_t)(i + 1); rest < 3; rest++)
            kilob_message_send()->type = (uint8_t)(0x20 + rest);
    }
}

TEST(reports_are_two_seconds_apart) {
    fake_reset();
    kilob_tracking_init();
    tracking_user_data_t data = {{1, 2, 3, 4, 5, 6, 7}};
    int reports = 0;
    for (kilo_ticks = 0; kilo_ticks < 620; kilo_ticks++) {
        kilob_tracking(&data);
        kilob_tracking(&data);
        const message_t *message = kilo_message_tx();
        if (message == NULL) continue;
        assert_int_equal(message->type, TRACKING);
        assert_memory_equal(message->data, data.byte, sizeof data.byte);
        assert_int_equal((kilo_ticks - 1) % 63, 0);
        kilo_message_tx_success();
        reports++;
    }
    assert_int_equal(reports, 10);
}

TEST(a_report_that_finds_the_queue_full_is_left_out) {
    fake_reset();
    kilob_tracking_init();
    while (kilob_message_send() != NULL) {
    }
    tracking_user_data_t data = {{0}};
    kilo_ticks = 100;
    kilob_tracking(&data);
    kilo_message_tx_success();
    kilob_tracking(&data);  // the next one comes two seconds later
    for (int left = 0; left < 2; left++) kilo_message_tx_success();
    assert_null(kilo_message_tx());
}

TEST(a_random_walk_goes_straight_then_turns_to_either_side) {
    fake_reset();
    g_ran_set_seed_uint32(7);
    kilob_random_walk_init(3, 0, 2, 0);
    uint32_t straight = 0, turning = 0, lefts = 0, turns = 0;
    direction_t before = UNDEFINED;
    for (kilo_ticks = 1; kilo_ticks < 100000; kilo_ticks++) {
        kilob_random_walk();
        const direction_t now = get_direction();
        straight += now == STRAIGHT;
        turning += now == LEFT || now == RIGHT;
        if (now != before && now != STRAIGHT) {
            turns++;
            lefts += now == LEFT;
        }
        before = now;
    }
    assert_binomial(lefts, turns, 0.5);
    // 3 s and 2 s of 31 ticks, and a tick or two in between.
    assert_in_range(straight / turns, 93, 96);
    assert_in_range(turning / turns, 62, 64);
    kilob_random_walk_reset();
    kilob_random_walk();
    assert_int_equal(get_direction(), STRAIGHT);
}

TEST(a_seed_of_zero_is_four_bytes_of_noise) {
    fake_reset();
    g_ran_set_seed_uint32(0);
    assert_int_equal(fake.rand_hard_calls, 4);
    const double drawn = g_ran_uniform();
    g_ran_set_seed_uint32(1);
    assert_int_equal(fake.rand_hard_calls, 4);
    assert_true(g_ran_uniform() != drawn);
}

enum { DRAWS = 100000 };

TEST(random_numbers_have_their_mean_and_spread) {
    g_ran_set_seed_uint32(3);
    double uniform = 0, whole = 0, exponential = 0, normal = 0, squares = 0;
    for (int i = 0; i < DRAWS; i++) {
        const double u = g_ran_uniform(), n = g_ran_gaussian(5, 2);
        assert_true(u >= 0 && u <= 1);
        uniform += u;
        whole += g_ran_uniform_uint32() / 4294967296.0;
        exponential += g_ran_exponential(0.5);
        normal += n;
        squares += (n - 5) * (n - 5);
    }
    const double root = sqrt(DRAWS);
    assert_true(fabs(uniform / DRAWS - 0.5) < 5 * 0.289 / root);
    assert_true(fabs(whole / DRAWS - 0.5) < 5 * 0.289 / root);
    assert_true(fabs(exponential / DRAWS - 2) < 5 * 2 / root);
    assert_true(fabs(normal / DRAWS - 5) < 5 * 2 / root);
    assert_true(fabs(squares / DRAWS - 4) < 5 * 5.7 / root);
}

TEST(a_ring_buffer_keeps_order_and_loses_the_oldest) {
    RB_create(numbers, int, 3);
    RB_init(numbers);
    assert_true(RB_empty(numbers));
    assert_int_equal(RB_capacity(numbers), 3);
    RB_popfront(numbers);
    for (int i = 0; i < 5; i++) {
        RB_back(numbers) = i;
        RB_pushback(numbers);
    }
    assert_true(RB_full(numbers));
    assert_int_equal(RB_size(numbers), 3);
    assert_int_equal(RB_front(numbers), 2);
    assert_int_equal(RB_idx(numbers, 2), 4);
    RB_popfront(numbers);
    int expected = 3;
    for (unsigned i = RB_begin(numbers); i != RB_end(numbers); RB_next(numbers, i))
        assert_int_equal(numbers.elems[i], expected++);
    assert_int_equal(expected, 5);
    RB_clear(numbers);
    assert_int_equal(RB_size(numbers), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_hosts_motion_commands_switch_the_motors_on_and_the_rest_is_passed_on),
        cmocka_unit_test(a_robot_is_pushed_only_when_it_changes_its_direction),
        cmocka_unit_test(motor_values_are_capped),
        cmocka_unit_test(messages_go_out_in_order_with_their_checksum_until_they_are_sent),
        cmocka_unit_test(reports_are_two_seconds_apart),
        cmocka_unit_test(a_report_that_finds_the_queue_full_is_left_out),
        cmocka_unit_test(a_random_walk_goes_straight_then_turns_to_either_side),
        cmocka_unit_test(a_seed_of_zero_is_four_bytes_of_noise),
        cmocka_unit_test(random_numbers_have_their_mean_and_spread),
        cmocka_unit_test(a_ring_buffer_keeps_order_and_loses_the_oldest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
