/// The CAN frames of a module's loader, byte by byte as the documents have them.
#include "../../../kilogrid_modules/bootloader/core/boot_frames.h"

#include <string.h>

#include "flash_model.h"

enum { BOOT = 0x06, PAGE, SIZE, NUMBER, IDLE = 0x0B, SETUP, RUN, CRCS = 0x16, QUERY, REPORT };
// Types that deployed boot loaders know are higher than those of the document by this.
#define OLDER 0x9F

static image_store_t store;
static boot_frames_t frames;
static program_t program;

static bool take(const uint8_t *data, uint8_t length) {
    uint8_t bytes[8] = {0};
    memcpy(bytes, data, length);
    return boot_frames_take(&frames, &store, bytes, length);
}

static void tell(uint8_t type, uint8_t second, uint8_t third) {
    const uint8_t data[8] = {type, second, third};
    assert_false(take(data, 8));
}

static void fresh(uint8_t pages, bool checked) {
    flash_erase_chip();
    program_make(&program, pages, 5, checked);
    image_store_init(&store);
    boot_frames_init(&frames);
}

static void announce(uint8_t older) {
    const uint16_t crc = program.image.crc;
    uint8_t check[8] = {(uint8_t)(SIZE + older), 1, (uint8_t)crc, (uint8_t)(crc >> 8)};
    memcpy(check + 4, program.image.id, 4);
    if (program.image.checked) assert_false(take(check, 8));
    tell((uint8_t)(SIZE + older), 0, program.image.pages);
}

static void send_chunk(uint8_t older, uint8_t page, uint8_t chunk) {
    uint8_t data[8] = {(uint8_t)(PAGE + older), chunk};
    for (int i = 0; i < 6; i++)
        data[2 + i] = chunk * 6 + i < 128 ? program.bytes[page * 128 + chunk * 6 + i] : 0xA5;
    assert_false(take(data, 8));
}

static void send_by_frames(uint8_t older, uint8_t page) {
    tell((uint8_t)(NUMBER + older), 0, page);
    for (uint8_t chunk = 0; chunk < 22; chunk++) send_chunk(older, page, chunk);
}

static uint32_t missing(uint8_t first) {
    uint8_t data[8];
    tell(QUERY, first, 0);
    assert_int_equal(frames.asked, first);
    boot_frames_answer(&frames, &store, data);
    assert_int_equal(data[0], REPORT);
    assert_int_equal(data[1], first);
    return data[2] | data[3] << 8 | data[4] << 16 | (uint32_t)data[5] << 24;
}

TEST(an_image_comes_by_frames_of_either_numbering) {
    for (int checked = 0; checked < 2; checked++)
        for (int numbering = 0; numbering < 2; numbering++) {
            const uint8_t older = numbering == 0 ? 0 : OLDER;
            fresh(5, checked != 0);
            announce(older);
            for (uint8_t page = 0; page < 5; page++) send_by_frames(older, page);
            work(&store);
            assert_int_equal(store.state, STORE_COMPLETE);
            assert_int_equal(store.image.checked, checked);
            assert_int_equal(flash_starts(NULL, &program, false), STARTS_NEW);
        }
}

TEST(a_check_holds_for_the_next_number_of_pages_alone) {
    fresh(5, true);
    announce(0);
    assert_memory_equal(&store.image, &program.image, sizeof program.image);
    tell(SIZE, 0, 5);
    assert_int_equal(store.image.checked, 0);
    assert_int_equal(store.image.crc, 0xFFFF);
    assert_memory_equal(store.image.id, "\xFF\xFF\xFF\xFF", 4);
}

TEST(other_parts_of_a_size_and_short_frames_do_nothing) {
    fresh(5, true);
    announce(0);
    send_chunk(0, 0, 0);  // no number has come
    tell(SIZE, 2, 9);
    for (uint8_t type = PAGE; type <= QUERY; type++)
        for (uint8_t second = 0; second < 2; second++) {
            const uint8_t data[8] = {type, second, 9};
            const uint8_t least = type == QUERY ? 2 : type == PAGE || type == CRCS ? 8 : 3;
            if (type >= IDLE && type <= RUN) continue;
            for (uint8_t length = 0; length < least; length++) assert_false(take(data, length));
        }
    // A check has CRC and id, up to its end.
    const uint8_t check[7] = {SIZE, 1, 9};
    assert_false(take(check, 7));
    assert_int_equal(frames.asked, BOOT_NOTHING_ASKED);
    assert_int_equal(frames.page, BOOT_NO_PAGE);
    assert_int_equal(frames.next.checked, 0);
    assert_memory_equal(&store.image, &program.image, sizeof program.image);
    assert_int_equal(flash_operations, 0);
}

TEST(chunks_behind_a_lost_number_are_not_taken_for_the_page_before) {
    fresh(3, false);
    announce(0);
    tell(NUMBER, 0, 0);
    for (uint8_t chunk = 0; chunk < 22; chunk++)
        if (chunk != 4) send_chunk(0, 0, chunk);
    for (uint8_t chunk = 0; chunk < 22; chunk++) send_chunk(0, 1, chunk);
    assert_int_equal(missing(0), 7);
    send_by_frames(0, 2);
    assert_int_equal(missing(0), 3);
    send_by_frames(0, 0);
    send_by_frames(0, 1);
    work(&store);
    assert_int_equal(flash_starts(NULL, &program, false), STARTS_NEW);
}

TEST(the_crcs_of_three_pages_are_checked) {
    fresh(8, true);
    announce(0);
    for (uint8_t page = 0; page < 8; page++) send_by_frames(0, page);
    for (uint8_t wrong = 0; wrong < 3; wrong++) {
        uint8_t data[8] = {CRCS, 3};
        for (int i = 0; i < 3; i++) {
            const uint16_t crc = plain_crc(program.bytes + (3 + i) * 128, 128);
            data[2 + 2 * i] = (uint8_t)crc;
            data[3 + 2 * i] = (uint8_t)(crc >> 8);
        }
        store.state = STORE_WRONG;
        assert_false(take(data, 8));
        assert_int_equal(missing(0), 0);
        data[2 + 2 * wrong]++;
        assert_false(take(data, 8));
        assert_int_equal(missing(0), 8 << wrong);
        // Beyond the last page a number would wrap round to page 0.
        data[1] = 255;
        assert_false(take(data, 8));
        assert_int_equal(missing(0), 8 << wrong);
        send_by_frames(0, (uint8_t)(3 + wrong));
    }
}

TEST(orders_to_run_leave_the_loader_and_other_frames_do_not) {
    fresh(5, true);
    for (int type = 0; type < 256; type++) {
        const uint8_t data[8] = {(uint8_t)type};
        const bool leaves = type == IDLE || type == SETUP || type == RUN || type == IDLE + OLDER;
        assert_int_equal(take(data, 1), leaves);
        assert_int_equal(take(data, 8), leaves);
    }
    assert_int_equal(flash_operations, 0);
}

TEST(boot_forgets_an_image_without_a_check) {
    for (int checked = 0; checked < 2; checked++) {
        fresh(5, checked != 0);
        announce(0);
        send_by_frames(0, 0);
        tell(BOOT, 0, 0);
        assert_int_equal(store.state, checked ? STORE_LOADING : STORE_EMPTY);
    }
}

TEST(nothing_has_come_at_the_start_whatever_was_in_memory) {
    fresh(5, false);
    memset(&frames, 0xA5, sizeof frames);
    boot_frames_init(&frames);
    announce(0);
    assert_false(store.image.checked);
    assert_int_equal(store.image.pages, 5);
}

TEST(a_question_of_two_bytes_is_one) {
    fresh(5, true);
    const uint8_t question[2] = {QUERY, 32}, half[1] = {QUERY};
    assert_false(take(half, 1));
    assert_int_equal(frames.asked, BOOT_NOTHING_ASKED);
    assert_false(take(question, 2));
    assert_int_equal(frames.asked, 32);
}

TEST(the_id_is_what_a_question_for_it_is_answered_with) {
    uint8_t data[8];
    fresh(5, true);
    announce(0);
    missing(0xE0);
    boot_frames_answer(&frames, &store, data);
    assert_memory_equal(data + 2, program.image.id, 4);
    assert_int_equal(data[6], BOOT_REPORT_LOADING);
    assert_int_equal(data[7], program.image.id[0]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_image_comes_by_frames_of_either_numbering),
        cmocka_unit_test(a_check_holds_for_the_next_number_of_pages_alone),
        cmocka_unit_test(other_parts_of_a_size_and_short_frames_do_nothing),
        cmocka_unit_test(chunks_behind_a_lost_number_are_not_taken_for_the_page_before),
        cmocka_unit_test(the_crcs_of_three_pages_are_checked),
        cmocka_unit_test(orders_to_run_leave_the_loader_and_other_frames_do_not),
        cmocka_unit_test(boot_forgets_an_image_without_a_check),
        cmocka_unit_test(nothing_has_come_at_the_start_whatever_was_in_memory),
        cmocka_unit_test(a_question_of_two_bytes_is_one),
        cmocka_unit_test(the_id_is_what_a_question_for_it_is_answered_with),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
