#include "core_support.h"
#include "runtime/core/answers.h"
#include "runtime/core/record_store.h"

TEST(ten_records_wait_and_further_ones_are_counted_up_to_255) {
    record_store_t store = {0, 0, 0};
    for (uint8_t i = 0; i < 10; i++) assert_int_equal(record_store_add(&store), i);
    for (int i = 0; i < 300; i++) assert_int_equal(record_store_add(&store), RECORD_STORE_FULL);
    assert_int_equal(store.used, 10);
    assert_int_equal(store.lost, 255);
}

TEST(records_are_taken_oldest_first_however_often_the_ring_goes_round) {
    record_store_t store = {0, 0, 0};
    int added = 0, taken = 0;
    for (uint8_t round = 0; round < 50; round++) {
        for (uint8_t i = 0; i < 1 + round % 10; i++)
            assert_int_equal(record_store_add(&store), added++ % 10);
        while (store.used > 0) assert_int_equal(record_store_take(&store), taken++ % 10);
    }
    assert_int_equal(added, taken);
    assert_int_equal(store.lost, 0);
}

TEST(a_store_that_is_cleared_still_knows_what_it_lost) {
    record_store_t store = {7, 10, 3};
    record_store_clear(&store);
    assert_int_equal(store.used, 0);
    assert_int_equal(store.lost, 3);
    assert_int_equal(record_store_add(&store), 7);
}

TEST(the_answer_to_a_poll_begins_with_the_number_of_records) {
    uint8_t data[8];
    memset(data, 0xA5, sizeof data);
    assert_int_equal(answers_poll(10, data), 2);
    const uint8_t expected[8] = {0x14, 10};
    assert_memory_equal(data, expected, sizeof data);
}

TEST(the_health_report_has_two_parts) {
    orders_t orders = fresh_orders();
    const health_facts_t facts = {0x1234, 0x5678, 5, 2, 96, 7};
    uint8_t data[8];
    orders.state = STATE_RUNNING;
    orders_count_refused(&orders, 9);
    assert_int_equal(answers_health(&orders, 0, &facts, data), 8);
    const uint8_t first[8] = {0x13, 0, 7, 5, 0x34, 0x12, 2, 9};
    assert_memory_equal(data, first, sizeof data);
    assert_int_equal(answers_health(&orders, 1, &facts, data), 8);
    const uint8_t second[8] = {0x13, 1, 96, 7, 0x78, 0x56, 1, 0};
    assert_memory_equal(data, second, sizeof data);
}

TEST(a_configuration_on_its_way_is_not_whole) {
    orders_t orders = fresh_orders();
    assert_int_equal(answers_configured(&orders, 0), 0);
    assert_int_equal(answers_configured(&orders, 7), 7);
    (void)give(&orders, CONFIG_SIZE, 0, 7);
    assert_int_equal(answers_configured(&orders, 7), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_records_wait_and_further_ones_are_counted_up_to_255),
        cmocka_unit_test(records_are_taken_oldest_first_however_often_the_ring_goes_round),
        cmocka_unit_test(a_store_that_is_cleared_still_knows_what_it_lost),
        cmocka_unit_test(the_answer_to_a_poll_begins_with_the_number_of_records),
        cmocka_unit_test(the_health_report_has_two_parts),
        cmocka_unit_test(a_configuration_on_its_way_is_not_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
