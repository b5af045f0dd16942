// Traits of the published module library, against ours on the same frames.
#include "core_support.h"
#include "runtime/core/main_loop.h"
#include "runtime/core/original_orders.h"

static order_t tell(orders_t *orders, const uint8_t *data, uint8_t length) {
    return original_receive(orders, data, length, false);
}

static order_t tell_number(orders_t *orders, uint8_t type, uint8_t number, uint8_t value) {
    const uint8_t data[8] = {type, number, value};
    return tell(orders, data, sizeof data);
}

// Chunk `chunk` of a page whose bytes are all `value`.
static order_t tell_chunk(orders_t *orders, uint8_t chunk, uint8_t value) {
    uint8_t data[8] = {KILO_PAGE, chunk};
    memset(data + 2, value, 6);
    return tell(orders, data, sizeof data);
}

static void tell_page(orders_t *orders, uint8_t page, uint8_t first_chunk, uint8_t value) {
    assert_int_equal(tell_number(orders, KILO_NUMBER, 0, page), ORDER_DONE);
    for (uint8_t chunk = first_chunk; chunk < 22; chunk++)
        assert_int_equal(tell_chunk(orders, chunk, value), ORDER_DONE);
    assert_int_equal(main_loop_job(orders), JOB_SEND_PAGE);
    orders->page = false;
}

TEST(frames_of_our_own_are_the_programs) {
    orders_t orders = fresh_orders();
    const uint8_t health[8] = {HEALTH}, question[8] = {ASK, 0xE1, 4, 7, 0xFF, 0xFF};
    assert_int_equal(tell(&orders, health, 8), ORDER_HAND_OVER);
    assert_int_equal(tell(&orders, question, 6), ORDER_HAND_OVER);
    assert_int_equal(orders.health, 0);
    assert_false(orders.ask);
    assert_int_equal(orders.refused, 0);
}

TEST(other_orders_are_obeyed_as_ours_obey_them) {
    for (unsigned type = 0; type < 0x100; type++) {
        if (type == HEALTH || type == ASK || type == KILO_PAGES) continue;
        for (uint8_t length = 0; length <= 8; length++) {
            orders_t ours = fresh_orders();
            orders_begin(&ours);
            orders_t original = ours;
            const uint8_t data[8] = {(uint8_t)type, 0, 1, 2, 3, 4, 5, 6};
            assert_int_equal(original_receive(&original, data, length, length == 7),
                             orders_receive(&ours, data, length, length == 7));
            assert_memory_equal(&original, &ours, sizeof ours);
        }
    }
}

TEST(a_check_counts_as_a_number_of_pages_and_is_forgotten) {
    orders_t orders = fresh_orders();
    assert_int_equal(tell_number(&orders, KILO_PAGES, 1, 77), ORDER_DONE);
    assert_int_equal(orders.transfer.kilo.pages, 77);
    assert_int_equal(tell_number(&orders, KILO_PAGES, 0, 3), ORDER_DONE);
    assert_int_equal(orders.transfer.kilo.pages, 3);
    assert_false(orders.transfer.kilo.checked);
    const uint8_t too_short[2] = {KILO_PAGES, 0};
    assert_int_equal(tell(&orders, too_short, 2), ORDER_REFUSED);
}

TEST(an_announcement_does_not_end_a_lap) {
    orders_t original = fresh_orders(), ours = fresh_orders();
    (void)tell_number(&original, KILO_PAGES, 0, 3);
    (void)give(&ours, KILO_PAGES, 0, 3);
    tell_page(&original, 1, 0, 9);
    give_page(&ours, 1);
    assert_int_equal(tell_number(&original, KILO_PAGES, 0, 3), ORDER_DONE);
    (void)give(&ours, KILO_PAGES, 0, 3);
    assert_int_equal(original.page_cell, 0);
    assert_int_equal(original.page_received, 1);
    assert_int_equal(ours.page_cell, 1);
    assert_int_equal(ours.page_received, 0);
}

TEST(a_page_without_its_first_chunk_has_the_bytes_that_were_there) {
    orders_t orders = fresh_orders();
    (void)tell_number(&orders, KILO_PAGES, 0, 3);
    tell_page(&orders, 0, 0, 0x11);
    tell_page(&orders, 1, 1, 0x22);
    const uint8_t *page = orders.transfer.kilo.data;
    for (uint8_t i = 0; i < 128; i++) assert_int_equal(page[i], i < 6 ? 0x11 : 0x22);
    // Without a second one it is no page.
    (void)tell_number(&orders, KILO_NUMBER, 0, 2);
    assert_int_equal(tell_chunk(&orders, 2, 0x33), ORDER_REFUSED);
    const uint8_t too_short[1] = {KILO_PAGE};
    (void)tell_number(&orders, KILO_NUMBER, 0, 2);
    assert_int_equal(tell(&orders, too_short, 1), ORDER_REFUSED);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_of_our_own_are_the_programs),
        cmocka_unit_test(other_orders_are_obeyed_as_ours_obey_them),
        cmocka_unit_test(a_check_counts_as_a_number_of_pages_and_is_forgotten),
        cmocka_unit_test(an_announcement_does_not_end_a_lap),
        cmocka_unit_test(a_page_without_its_first_chunk_has_the_bytes_that_were_there),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
