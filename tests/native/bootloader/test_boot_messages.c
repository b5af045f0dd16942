/// The infrared messages of a robot's loader, byte by byte as the document has them.
#include "bootloader/core/boot_messages.h"

#include <string.h>

#include "flash_model.h"
#include "message_crc.h"

#define UID 0x1234

static image_store_t store;
static program_t program;
static boot_query_t query;

static boot_order_t take(uint8_t type, const char *data, size_t count) {
    message_t message;
    memset(&message, 0, sizeof message);
    memcpy(message.data, data, count);
    message.type = type;
    return boot_message_take(&store, &message, UID, &query);
}

static void fresh(uint8_t pages, bool checked) {
    flash_erase_chip();
    program_make(&program, pages, 5, checked);
    image_store_init(&store);
}

static void announce(void) {
    uint8_t data[9] = {program.image.pages, 'K', 'T', (uint8_t)program.image.crc,
                       (uint8_t)(program.image.crc >> 8)};
    memcpy(data + 5, program.image.id, 4);
    take(0x82, (const char *)data, program.image.checked ? 9 : 1);
}

static void send_by_messages(uint8_t page) {
    for (uint8_t offset = 0; offset < 64; offset = (uint8_t)(offset + 3)) {
        uint8_t data[9] = {page, offset};
        for (int i = 0; i < 6 && 2 * offset + i < 128; i++)
            data[2 + i] = program.bytes[page * 128 + 2 * offset + i];
        take(0x81, (const char *)data, 9);
    }
}

static void load_by_messages(void) {
    announce();
    send_by_messages(0);
    work(&store);
    for (uint8_t page = 0; page < program.image.pages; page++) send_by_messages(page);
    work(&store);
}

TEST(an_image_comes_by_messages) {
    for (int checked = 0; checked < 2; checked++) {
        fresh(5, checked != 0);
        load_by_messages();
        assert_int_equal(store.state, STORE_COMPLETE);
        assert_int_equal(store.image.checked, checked);
        assert_int_equal(flash_starts(NULL, &program, false), STARTS_NEW);
    }
}

TEST(a_size_without_both_letters_has_no_crc) {
    for (int letter = 1; letter < 3; letter++) {
        char data[9] = "\x05KTabcdef";
        fresh(5, true);
        data[letter]++;
        take(0x82, data, 9);
        assert_int_equal(store.image.checked, 0);
        assert_int_equal(store.image.crc, 0xFFFF);
        assert_memory_equal(store.image.id, "\xFF\xFF\xFF\xFF", 4);
    }
}

TEST(offsets_that_no_sender_uses_are_ignored) {
    fresh(2, true);
    announce();
    for (int offset = 0; offset < 256; offset++) {
        const char data[9] = {0, (char)offset};
        if (offset % 3 == 0 && offset < 64) continue;
        take(0x81, data, 9);
        assert_int_equal(store.state, STORE_ANNOUNCED);
    }
}

TEST(the_crcs_of_four_pages_are_checked) {
    fresh(6, true);
    announce();
    send_by_messages(0);
    work(&store);
    send_by_messages(4);
    send_by_messages(5);
    uint8_t data[9] = {4};
    for (int i = 0; i < 4; i++) {
        const uint16_t crc = plain_crc(program.bytes + (4 + i) * 128, 128);
        data[1 + 2 * i] = (uint8_t)crc;
        data[2 + 2 * i] = (uint8_t)(crc >> 8);
    }
    take(0x8B, (const char *)data, 9);
    data[3]++;
    for (int first = 0; first < 256; first++) {
        data[0] = (uint8_t)first;
        if (first % 4 != 0 || first > 216) take(0x8B, (const char *)data, 9);
    }
    uint8_t report[BOOT_REPORT_BYTES];
    image_store_report(&store, 0, report);
    assert_int_equal(report[0], 0x0E);
    data[0] = 4;
    take(0x8B, (const char *)data, 9);
    image_store_report(&store, 0, report);
    assert_int_equal(report[0], 0x2E);
}

TEST(a_query_is_answered_by_those_it_asks) {
    fresh(40, true);
    assert_int_equal(take(0x8C, "\x20\x00\x00\xFF\xFF", 5), BOOT_ORDER_ANSWER);
    assert_int_equal(query.first, 0x20);
    assert_int_equal(query.slot, 0);
    assert_int_equal(take(0x8C, "\xE0\x03\x11\x34\x12", 5), BOOT_ORDER_ANSWER);
    assert_int_equal(query.first, BOOT_QUERY_IDENTITY);
    assert_int_equal(query.slot, robot_query_slot(UID, 0x11, 3));
    assert_int_equal(take(0x8C, "\xE0\x03\x11\x35\x12", 5), BOOT_ORDER_NONE);
    assert_int_equal(take(0x8C, "\xE0\x03\x11\xFF\x12", 5), BOOT_ORDER_NONE);
}

TEST(a_report_is_a_message) {
    message_t message;
    fresh(40, true);
    announce();
    send_by_messages(0);
    work(&store);
    send_by_messages(33);
    boot_message_report(&store, 32, UID, &message);
    const uint8_t expected[] = {0x34, 0x12, 32, 0xFD, 0, 0, 0, 1, program.image.id[0]};
    assert_memory_equal(message.data, expected, 9);
    assert_int_equal(message.type, 0x8D);
    assert_int_equal(message.crc, message_crc(&message));
}

TEST(commands_leave_and_other_messages_do_not) {
    fresh(5, true);
    for (int type = 0; type < 256; type++) {
        const bool leaves = (type >= 0x83 && type <= 0x8A) || type == 0x8E;
        const boot_order_t order = take((uint8_t)type, "\0\0\0\1\0", 5);
        assert_int_equal(order, leaves ? BOOT_ORDER_LEAVE : BOOT_ORDER_NONE);
    }
    assert_int_equal(flash_operations, 0);
}

TEST(boot_forgets_an_image_without_a_crc_as_the_original_does) {
    fresh(5, false);
    announce();
    send_by_messages(0);
    work(&store);
    send_by_messages(1);
    take(0x80, "", 0);
    assert_int_equal(store.state, STORE_EMPTY);
    fresh(5, true);
    announce();
    send_by_messages(0);
    work(&store);
    send_by_messages(1);
    take(0x80, "", 0);
    assert_int_equal(store.state, STORE_LOADING);
    assert_int_equal(store.stored, 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_image_comes_by_messages),
        cmocka_unit_test(a_size_without_both_letters_has_no_crc),
        cmocka_unit_test(offsets_that_no_sender_uses_are_ignored),
        cmocka_unit_test(the_crcs_of_four_pages_are_checked),
        cmocka_unit_test(a_query_is_answered_by_those_it_asks),
        cmocka_unit_test(a_report_is_a_message),
        cmocka_unit_test(commands_leave_and_other_messages_do_not),
        cmocka_unit_test(boot_forgets_an_image_without_a_crc_as_the_original_does),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
