#include <string.h>

#include "../firmware/support.h"
#include "runtime/core/api.h"

TEST(a_can_message_begins_with_eight_zeros) {
    CAN_message_t message;
    memset(&message, 0xA5, sizeof message);
    api_init_can_message(&message);
    assert_int_equal(message.header.length, 8);
    assert_int_equal(message.header.rtr, 0);
    for (uint8_t i = 0; i < 8; i++) assert_int_equal(message.data[i], 0);
}

TEST(a_tracking_record_holds_the_cell_and_seven_bytes) {
    const tracking_user_data_t data = {{1, 2, 3, 4, 5, 6, 7}};
    for (uint8_t cell = 0; cell < 8; cell++) {
        CAN_message_t message;
        api_fill_record(&message, cell, &data);
        assert_int_equal(message.data[0], 0x11 | (cell % 4) << 6);
        assert_memory_equal(message.data + 1, data.byte, 7);
    }
}

TEST(a_random_number_is_in_its_range) {
    for (int drawn = 0; drawn < 32768; drawn += 7) {
        const uint16_t number = api_in_range(10, 20, drawn);
        assert_in_range(number, 10, 19);
    }
    assert_int_equal(api_in_range(5, 3, 70), 75);  // the AVR's 16 bits wrap
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_can_message_begins_with_eight_zeros),
        cmocka_unit_test(a_tracking_record_holds_the_cell_and_seven_bytes),
        cmocka_unit_test(a_random_number_is_in_its_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
