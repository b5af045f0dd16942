#include "wire.h"

#include "support.h"

static void assert_bytes(const uint8_t *data, const uint8_t *expected) {
    assert_memory_equal(data, expected, WIRE_DATA_BYTES);
}

TEST(a_cell_message_holds_site_and_flags) {
    uint8_t data[WIRE_DATA_BYTES];
    wire_put_cell(data, (wire_cell_t){7, WIRE_CELL_WALL | WIRE_CELL_OBSTACLE});
    assert_bytes(data, (const uint8_t[]){7, 3, 0, 0, 0, 0, 0, 0, 0});
    const wire_cell_t cell = wire_get_cell(data);
    assert_int_equal(cell.site, 7);
    assert_int_equal(cell.flags, 3);
}

TEST(a_signal_message_holds_the_uid_low_byte_first) {
    uint8_t data[WIRE_DATA_BYTES];
    wire_put_signal(data, 0xABCD);
    assert_bytes(data, (const uint8_t[]){0xCD, 0xAB, 0, 0, 0, 0, 0, 0, 0});
    for (uint32_t uid = 0; uid <= UINT16_MAX; uid++) {
        wire_put_signal(data, (uint16_t)uid);
        assert_int_equal(wire_get_signal(data), uid);
    }
}

TEST(a_config_message_holds_range_key_and_value_low_bytes_first) {
    uint8_t data[WIRE_DATA_BYTES];
    wire_put_config(data, (wire_config_t){0x0102, 0xF3F4, 0x85, 0x96A7B8C9});
    assert_bytes(data, (const uint8_t[]){0x02, 0x01, 0xF4, 0xF3, 0x85, 0xC9, 0xB8, 0xA7, 0x96});
    const wire_config_t config = wire_get_config(data);
    assert_int_equal(config.uid_first, 0x0102);
    assert_int_equal(config.uid_last, 0xF3F4);
    assert_int_equal(config.key, 0x85);
    assert_int_equal(config.value, 0x96A7B8C9);
}

TEST(a_report_holds_uid_led_cell_and_number_in_seven_bytes) {
    uint8_t data[WIRE_DATA_BYTES];
    wire_put_tracking(data, (wire_tracking_t){0xABCD, 0x3F, {7, 1}, 0x1234});
    assert_bytes(data, (const uint8_t[]){0xCD, 0xAB, 0x3F, 7, 1, 0x34, 0x12, 0, 0});
    const wire_tracking_t report = wire_get_tracking(data);
    assert_int_equal(report.uid, 0xABCD);
    assert_int_equal(report.led, 0x3F);
    assert_int_equal(report.cell.site, 7);
    assert_int_equal(report.cell.flags, 1);
    assert_int_equal(report.number, 0x1234);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cell_message_holds_site_and_flags),
        cmocka_unit_test(a_signal_message_holds_the_uid_low_byte_first),
        cmocka_unit_test(a_config_message_holds_range_key_and_value_low_bytes_first),
        cmocka_unit_test(a_report_holds_uid_led_cell_and_number_in_seven_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
