/// The message CRC, against its definition bit by bit and known values.
#include "message_crc.h"

#include <stdlib.h>

#include "../../firmware/support.h"

static uint16_t bit_by_bit(const message_t *message) {
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < 10; i++) {
        crc ^= ((const uint8_t *)message)[i];
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)((crc & 1) != 0 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}

TEST(known_messages_have_their_crc) {
    message_t message = {{0}, 0, 0};
    assert_int_equal(message_crc(&message), 0x9C87);
    message.type = 1;
    assert_int_equal(message_crc(&message), 0x8D0E);
    message.type = 0x88;
    assert_int_equal(message_crc(&message), 0x94C7);
    for (uint8_t i = 0; i < 9; i++) message.data[i] = (uint8_t)(i + 1);
    message.type = 2;
    assert_int_equal(message_crc(&message), 0x840A);
    for (uint8_t i = 0; i < 9; i++) message.data[i] = 0xFF;
    message.type = 0x7F;
    assert_int_equal(message_crc(&message), 0x036D);
}

TEST(it_is_the_reflected_polynomial_8408) {
    srand(1);
    for (int n = 0; n < 20000; n++) {
        message_t message;
        for (size_t i = 0; i < sizeof message; i++) ((uint8_t *)&message)[i] = (uint8_t)rand();
        assert_int_equal(message_crc(&message), bit_by_bit(&message));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(known_messages_have_their_crc),
        cmocka_unit_test(it_is_the_reflected_polynomial_8408),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
