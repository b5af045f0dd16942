#include "address.h"

#include "kilogrid_can.h"
#include "support.h"

static kilogrid_address_t address(uint8_t x, uint8_t y, uint8_t type) {
    return (kilogrid_address_t){x, y, type};
}

static void assert_reads(uint16_t id, uint8_t x, uint8_t y, uint8_t type) {
    kilogrid_address_t read = {99, 99, 99};
    assert_true(kilogrid_address(id, &read));
    assert_int_equal(read.x, x);
    assert_int_equal(read.y, y);
    assert_int_equal(read.type, type);
}

TEST(identifiers_are_those_of_the_specification) {
    assert_int_equal(kilogrid_id(address(0, 0, ADDR_BROADCAST)), 0x000);
    assert_int_equal(kilogrid_id(address(9, 9, ADDR_BROADCAST)), 0x000);
    assert_int_equal(kilogrid_id(address(7, 0, ADDR_ROW)), 0x040);
    assert_int_equal(kilogrid_id(address(0, 19, ADDR_ROW)), 20 << 6);
    assert_int_equal(kilogrid_id(address(0, 7, ADDR_COLUMN)), 0x002);
    assert_int_equal(kilogrid_id(address(9, 0, ADDR_COLUMN)), 10 << 1);
    assert_int_equal(kilogrid_id(address(0, 0, ADDR_INDIVIDUAL)), 0x042);
    assert_int_equal(kilogrid_id(address(9, 19, ADDR_INDIVIDUAL)), 20 << 6 | 10 << 1);
    assert_int_equal(kilogrid_id(address(9, 19, ADDR_DISPATCHER)), 20 << 6 | 10 << 1 | 1);
    assert_int_equal(kilogrid_id(address(30, 30, ADDR_INDIVIDUAL)), 0x7FE);
    assert_int_equal(kilogrid_id(address(30, 30, ADDR_DISPATCHER)), 0x7FF);
}

TEST(every_identifier_is_read_as_what_it_was_made_from_or_refused) {
    uint32_t refused = 0;
    for (uint16_t id = 0; id <= 0x7FF; id++) {
        kilogrid_address_t read = {99, 99, 99};
        if (kilogrid_address(id, &read)) {
            assert_int_equal(kilogrid_id(read), id);
        } else {
            // To the host, but from no module: a coordinate field is 0.
            assert_true((id & 1) && ((id & 0x3E) == 0 || (id & 0x7C0) == 0));
            assert_int_equal(read.x + read.y + read.type, 3 * 99);
            refused++;
        }
    }
    assert_int_equal(refused, 32 + 31);
    assert_reads(0x000, 0, 0, ADDR_BROADCAST);
    assert_reads(0x7C0, 0, 30, ADDR_ROW);
    assert_reads(0x03E, 30, 0, ADDR_COLUMN);
    assert_reads(0x045, 1, 0, ADDR_DISPATCHER);
}

TEST(more_than_eleven_bits_are_no_identifier) {
    kilogrid_address_t read;
    for (uint32_t id = 0x800; id <= 0xFFFF; id++)
        assert_false(kilogrid_address((uint16_t)id, &read));
}

TEST(what_cannot_be_an_address_has_no_identifier) {
    assert_int_equal(kilogrid_id(address(31, 0, ADDR_INDIVIDUAL)), KILOGRID_NO_ID);
    assert_int_equal(kilogrid_id(address(0, 31, ADDR_DISPATCHER)), KILOGRID_NO_ID);
    assert_int_equal(kilogrid_id(address(31, 0, ADDR_COLUMN)), KILOGRID_NO_ID);
    assert_int_equal(kilogrid_id(address(0, 255, ADDR_ROW)), KILOGRID_NO_ID);
    for (uint16_t type = 4; type < 255; type++)
        assert_int_equal(kilogrid_id(address(0, 0, (uint8_t)type)), KILOGRID_NO_ID);
    // A coordinate that says nothing may be anything.
    assert_int_equal(kilogrid_id(address(255, 3, ADDR_ROW)), 4 << 6);
    assert_int_equal(kilogrid_id(address(3, 255, ADDR_COLUMN)), 4 << 1);
}

TEST(the_filters_of_a_module_let_through_what_reaches_it_and_nothing_else) {
    uint16_t ids[KILOGRID_FILTERS];
    assert_true(kilogrid_filters(9, 19, ids));
    uint16_t passed = 0;
    for (uint16_t id = 0; id <= 0x7FF; id++) {
        bool passes = false;
        for (uint8_t i = 0; i < KILOGRID_FILTERS; i++)
            passes = passes || (id & KILOGRID_MODULE_MASK) == (ids[i] & KILOGRID_MODULE_MASK);
        kilogrid_address_t to;
        bool meant = kilogrid_address(id, &to) && to.type != ADDR_DISPATCHER &&
                     (to.type == ADDR_BROADCAST || to.type == ADDR_ROW || to.x == 9) &&
                     (to.type == ADDR_BROADCAST || to.type == ADDR_COLUMN || to.y == 19);
        assert_int_equal(passes, meant);
        passed += passes;
    }
    assert_int_equal(passed, 4);
    assert_false(kilogrid_filters(31, 0, ids));
    assert_false(kilogrid_filters(0, 31, ids));
}

TEST(a_broadcast_comes_before_rows_and_those_before_modules_further_up) {
    assert_true(kilogrid_id(address(0, 0, ADDR_BROADCAST)) <
                kilogrid_id(address(0, 0, ADDR_COLUMN)));
    assert_true(kilogrid_id(address(30, 0, ADDR_COLUMN)) < kilogrid_id(address(0, 0, ADDR_ROW)));
    assert_true(kilogrid_id(address(0, 0, ADDR_ROW)) < kilogrid_id(address(0, 0, ADDR_INDIVIDUAL)));
}

TEST(lengths_are_those_of_the_specification) {
    for (uint16_t type = 0; type <= 255; type++) {
        uint8_t to_module = type == 0x15 ? 1 : type == 0x13 ? 2 : 8;
        assert_int_equal(kilogrid_dlc_to_module((uint8_t)type), to_module);
        assert_int_equal(kilogrid_dlc_to_host((uint8_t)type), type == 0x14 ? 2 : 8);
        assert_true(kilogrid_least_dlc_to_module((uint8_t)type) <= to_module);
        assert_true(kilogrid_least_dlc_to_host((uint8_t)type) <=
                    kilogrid_dlc_to_host((uint8_t)type));
        assert_true(kilogrid_least_dlc_to_module((uint8_t)type) >= 1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identifiers_are_those_of_the_specification),
        cmocka_unit_test(every_identifier_is_read_as_what_it_was_made_from_or_refused),
        cmocka_unit_test(more_than_eleven_bits_are_no_identifier),
        cmocka_unit_test(what_cannot_be_an_address_has_no_identifier),
        cmocka_unit_test(the_filters_of_a_module_let_through_what_reaches_it_and_nothing_else),
        cmocka_unit_test(a_broadcast_comes_before_rows_and_those_before_modules_further_up),
        cmocka_unit_test(lengths_are_those_of_the_specification),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
