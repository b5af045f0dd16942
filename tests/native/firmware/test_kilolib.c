/// The headers of the Kilobot API: what programs rely on.
#include <debug.h>
#include <kilombo.h>
#include <message_buffered.h>

#include "fake_kilolib.h"
#include "support.h"

typedef struct {
    int count;
} USERDATA;

REGISTER_USERDATA(USERDATA)

TEST(messages_and_distances_have_the_layout_of_the_wire) {
    assert_int_equal(sizeof(message_t), 12);
    assert_int_equal(offsetof(message_t, type), 9);
    assert_int_equal(offsetof(message_t, crc), 10);
    assert_int_equal(sizeof(distance_measurement_t), 4);
    assert_int_equal(offsetof(distance_measurement_t, low_gain), 0);
}

TEST(message_types_have_their_numbers) {
    const message_type_t types[] = {NORMAL, GPS,     BOOT,   BOOTPGM_PAGE, BOOTPGM_SIZE,
                                    RESET,  SLEEP,   WAKEUP, CHARGE,       VOLTAGE,
                                    RUN,    READUID, CALIB};
    const uint8_t numbers[] = {0x00, 0x01, 0x80, 0x81, 0x82, 0x83, 0x84,
                               0x85, 0x86, 0x87, 0x88, 0x89, 0x8A};
    for (size_t i = 0; i < sizeof numbers; i++) assert_int_equal(types[i], numbers[i]);
}

TEST(a_colour_has_two_bits_a_part_and_is_one_value_in_any_expression) {
    assert_int_equal(RGB(3, 0, 0), 0x03);
    assert_int_equal(RGB(0, 3, 0), 0x0C);
    assert_int_equal(RGB(0, 0, 3), 0x30);
    assert_int_equal(RGB(5, 6, 7), RGB(1, 2, 3));
    assert_true(RGB(1, 1, 1) == 0x15);
    assert_int_equal(RGB(1 | 2, 0, 0), 3);
}

TEST(the_guards_are_those_programs_test_for) {
#if !defined(__KILOLIB_H__) || !defined(__MESSAGES_H__) || !defined(__MESSAGE_CRC_H__) || \
    !defined(__DEBUG_H__)
    fail();
#endif
}

TEST(without_debug_printing_vanishes) {
    int evaluated = 0;
    debug_init();
    printf("%d\n", ++evaluated);
    assert_int_equal(evaluated, 0);
}

TEST(kilombo_programs_find_their_data_at_zero) {
    SET_CALLBACK(botinfo, nothing);
    assert_int_equal(mydata->count, 0);
    mydata->count = 5;
    assert_int_equal(myuserdata.count, 5);
}

static message_t message_of(uint8_t number) { return (message_t){{number}, NORMAL, 0}; }

static void receive(uint8_t number) {
    message_t message = message_of(number);
    distance_measurement_t distance = {number, (int16_t)(number + 1)};
    kilo_message_rx(&message, &distance);
}

TEST(received_messages_wait_in_order_with_their_distances) {
    kilo_message_buffered();
    distance_measurement_t distance;
    assert_null(rxbuffer_peek(&distance));
    rxbuffer_pop();
    assert_int_equal(rxbuffer_size(), 0);

    uint8_t in = 0;
    uint8_t out = 0;
    for (int round = 0; round < 100; round++) {  // many times round the ring
        for (int i = 0; i < 7; i++) receive(in++);
        assert_int_equal(rxbuffer_size(), 7);
        for (int i = 0; i < 7; i++) {
            assert_int_equal(rxbuffer_peek(&distance)->data[0], out);
            assert_int_equal(distance.low_gain, out);
            assert_int_equal(distance.high_gain, out + 1);
            rxbuffer_pop();
            out++;
        }
    }
}

TEST(a_full_receive_queue_keeps_what_it_has) {
    kilo_message_buffered();
    for (uint8_t i = 0; i < RXBUFFER_SIZE + 5; i++) receive(i);
    assert_int_equal(rxbuffer_size(), RXBUFFER_SIZE);
    distance_measurement_t distance;
    for (uint8_t i = 0; i < RXBUFFER_SIZE; i++) {
        assert_int_equal(rxbuffer_peek(&distance)->data[0], i);
        rxbuffer_pop();
    }
    assert_null(rxbuffer_peek(&distance));
}

TEST(messages_to_send_go_out_in_order_and_stay_until_they_are_sent) {
    kilo_message_buffered();
    assert_null(kilo_message_tx());
    kilo_message_tx_success();
    for (uint8_t i = 0; i < TXBUFFER_SIZE + 2; i++) {
        message_t message = message_of(i);
        txbuffer_push(&message);
    }
    assert_int_equal(txbuffer_size(), TXBUFFER_SIZE);
    for (uint8_t i = 0; i < TXBUFFER_SIZE; i++) {
        assert_int_equal(kilo_message_tx()->data[0], i);
        assert_int_equal(kilo_message_tx()->data[0], i);  // the channel was busy: once more
        kilo_message_tx_success();
    }
    assert_null(kilo_message_tx());
    assert_int_equal(txbuffer_size(), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(messages_and_distances_have_the_layout_of_the_wire),
        cmocka_unit_test(message_types_have_their_numbers),
        cmocka_unit_test(a_colour_has_two_bits_a_part_and_is_one_value_in_any_expression),
        cmocka_unit_test(the_guards_are_those_programs_test_for),
        cmocka_unit_test(without_debug_printing_vanishes),
        cmocka_unit_test(kilombo_programs_find_their_data_at_zero),
        cmocka_unit_test(received_messages_wait_in_order_with_their_distances),
        cmocka_unit_test(a_full_receive_queue_keeps_what_it_has),
        cmocka_unit_test(messages_to_send_go_out_in_order_and_stay_until_they_are_sent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
