/// Pages and laps: what the store makes of announcements, fragments and CRCs.
#include "bootloader/core/image_store.h"

#include <string.h>

#include "flash_model.h"

static image_store_t store;
static program_t program, other;

static void fresh(uint8_t pages, bool checked) {
    flash_erase_chip();
    program_make(&program, pages, pages + 1u, checked);
    memset(&store, 0xA5, sizeof store);
    image_store_init(&store);
}

// Announced, and one fragment there.
static void begin(void) {
    image_store_announce(&store, &program.image);
    send_fragment(&store, &program, 0, 0);
    work(&store);
    assert_int_equal(store.state, STORE_LOADING);
}

static uint32_t missing(uint8_t first) {
    uint8_t report[BOOT_REPORT_BYTES];
    image_store_report(&store, first, report);
    return report[0] | report[1] << 8 | report[2] << 16 | (uint32_t)report[3] << 24;
}

static uint8_t reported_state(void) {
    uint8_t report[BOOT_REPORT_BYTES];
    image_store_report(&store, 0, report);
    return report[4];
}

static uint16_t page_crc(const program_t *of, uint8_t page) {
    return plain_crc(of->bytes + page * BOOT_PAGE_BYTES, BOOT_PAGE_BYTES);
}

static void assert_runs(const program_t *expected) {
    assert_int_equal(flash_starts(NULL, expected, false), STARTS_NEW);
    assert_int_equal(flash_starts(NULL, expected, true), STARTS_NEW);
}

TEST(images_of_every_size_are_stored_and_valid) {
    for (int checked = 0; checked < 2; checked++)
        for (uint8_t pages = 1; pages <= BOOT_PAGES; pages++) {
            fresh(pages, checked != 0);
            load(&store, &program);
            assert_int_equal(store.state, STORE_COMPLETE);
            assert_int_equal(reported_state(), BOOT_REPORT_COMPLETE);
            assert_int_equal(flash_operations, pages + 2u);  // page 0 twice, and the record
            assert_runs(&program);
        }
}

TEST(the_record_knows_the_crc_also_if_none_was_sent) {
    image_record_t record;
    fresh(3, false);
    load(&store, &program);
    assert_true(image_record_read(&record));
    assert_int_equal(record.image.checked, 0);
    assert_int_equal(record.image.crc, plain_crc(program.bytes, 3 * BOOT_PAGE_BYTES));
    for (int i = 0; i < IMAGE_ID_BYTES; i++) assert_int_equal(record.image.id[i], 0xFF);
}

TEST(an_image_of_no_pages_or_too_many_is_ignored) {
    fresh(3, true);
    for (int pages = 0; pages < 256; pages++) {
        if (pages >= 1 && pages <= BOOT_PAGES) continue;
        program.image.pages = (uint8_t)pages;
        image_store_announce(&store, &program.image);
        assert_int_equal(store.state, STORE_EMPTY);
    }
}

TEST(nothing_is_erased_before_a_fragment_of_an_announced_image) {
    fresh(3, true);
    program_make(&other, 9, 99, true);
    flash_install(&other, true);
    send_lap(&store, &program);
    work(&store);
    image_store_announce(&store, &program.image);
    work(&store);
    assert_int_equal(store.state, STORE_ANNOUNCED);
    send_fragment(&store, &program, 3, 0);   // no such page
    send_fragment(&store, &program, 0, 22);  // no such fragment
    work(&store);
    assert_int_equal(flash_operations, 0);
    assert_int_equal(reported_state(), BOOT_REPORT_LOADING);
    assert_int_equal(flash_starts(&other, NULL, false), STARTS_OLD);
    send_fragment(&store, &program, 2, 21);
    work(&store);
    assert_int_equal(flash_starts(&other, NULL, false), STARTS_LOADER);
}

TEST(a_lap_over_an_old_program_is_enough_and_takes_two_operations_a_page_and_five) {
    for (uint8_t old_pages = 1; old_pages < 12; old_pages++)
        for (uint8_t pages = 1; pages < 12; pages++) {
            fresh(pages, pages % 2 == 0);
            program_make(&other, old_pages, 99, true);
            flash_install(&other, true);
            load(&store, &program);
            assert_int_equal(store.state, STORE_COMPLETE);
            // Record; page 1, perhaps blank, written; page 0 erased and written. Then a write a
            // page, an erase where the old program or page 1 was, and the record.
            const uint8_t old = old_pages > 1 ? old_pages : 2;
            assert_int_equal(flash_operations,
                             1u + (old_pages > 1) + 1 + 2 + pages + (old - 1) + 1);
            assert_runs(&program);
        }
}

TEST(the_first_fragment_whichever_it_is_is_kept) {
    for (uint8_t page = 0; page < 3; page++)
        for (uint8_t fragment = 0; fragment < BOOT_FRAGMENTS; fragment++) {
            fresh(3, true);
            program_make(&other, 9, 99, true);
            flash_install(&other, true);
            image_store_announce(&store, &program.image);
            send_fragment(&store, &program, page, fragment);
            for (uint8_t n = 0; n < 3 * BOOT_FRAGMENTS; n++)
                if (n != page * BOOT_FRAGMENTS + fragment)
                    send_fragment(&store, &program, n / BOOT_FRAGMENTS, n % BOOT_FRAGMENTS);
            work(&store);
            assert_runs(&program);
        }
}

TEST(what_lies_between_the_longest_application_and_the_record_is_erased) {
    fresh(1, true);
    flash[221 * BOOT_PAGE_BYTES + 5] = 0x12;
    load(&store, &program);
    assert_int_equal(flash[221 * BOOT_PAGE_BYTES + 5], 0xFF);
    assert_runs(&program);
}

TEST(the_same_announcement_again_changes_nothing_and_another_one_begins_anew) {
    fresh(3, true);
    begin();
    send_page(&store, &program, 1);
    image_store_announce(&store, &program.image);
    assert_int_equal(missing(0), 5);
    for (int what = 0; what < 4; what++) {
        image_t changed = program.image;
        if (what == 0) changed.pages = 2;
        if (what == 1) changed.crc ^= 1;
        if (what == 2) changed.id[3] ^= 1;
        if (what == 3) changed.checked = 0;
        image_store_announce(&store, &changed);
        assert_int_equal(store.state, STORE_ANNOUNCED);
        assert_int_equal(missing(0), changed.pages == 2 ? 3 : 7);
    }
    load(&store, &program);
    assert_runs(&program);
    image_store_announce(&store, &program.image);
    assert_int_equal(store.state, STORE_COMPLETE);
}

TEST(another_image_in_the_middle_of_one_is_stored_alone) {
    fresh(5, true);
    program_make(&other, 4, 77, true);
    begin();
    for (uint8_t page = 0; page < 3; page++) send_page(&store, &program, page);
    send_fragment(&store, &program, 3, 5);
    load(&store, &other);
    assert_runs(&other);
}

TEST(pages_are_reported_by_32_from_any_on) {
    fresh(70, true);
    begin();
    assert_int_equal(missing(0), 0xFFFFFFFF);
    assert_int_equal(missing(64), 0x3F);
    assert_int_equal(missing(70), 0);
    assert_int_equal(missing(255), 0);
    send_page(&store, &program, 33);
    send_page(&store, &program, 69);
    send_fragment(&store, &program, 34, 1);
    assert_int_equal(missing(32), 0xFFFFFFFD);
    assert_int_equal(missing(33), 0xFFFFFFFE);
    assert_int_equal(missing(64), 0x1F);
}

TEST(the_id_is_reported_of_what_is_announced_or_else_of_what_is_valid) {
    uint8_t report[BOOT_REPORT_BYTES];
    fresh(3, true);
    image_store_report(&store, BOOT_QUERY_IDENTITY, report);
    assert_memory_equal(report, "\xFF\xFF\xFF\xFF\x00\xFF", 6);
    flash_install(&program, true);
    image_store_report(&store, BOOT_QUERY_IDENTITY, report);
    assert_memory_equal(report, program.image.id, IMAGE_ID_BYTES);
    assert_int_equal(report[4], BOOT_REPORT_COMPLETE);
    assert_int_equal(report[5], program.image.id[0]);
    program_make(&other, 3, 55, true);
    image_store_announce(&store, &other.image);
    image_store_report(&store, BOOT_QUERY_IDENTITY, report);
    assert_memory_equal(report, other.image.id, IMAGE_ID_BYTES);
    assert_int_equal(report[4], BOOT_REPORT_LOADING);
}

TEST(fragments_that_come_twice_do_not_stand_in_for_those_that_were_lost) {
    fresh(2, true);
    begin();
    for (uint8_t i = 0; i < BOOT_FRAGMENTS; i++) {
        if (i != 7) send_fragment(&store, &program, 0, i);
        send_fragment(&store, &program, 0, 8);
    }
    send_page(&store, &program, 1);
    assert_int_equal(missing(0), 1);
    work(&store);
    assert_int_equal(store.state, STORE_LOADING);
    send_fragment(&store, &program, 0, 7);
    work(&store);
    assert_runs(&program);
}

TEST(an_image_whose_crc_is_wrong_is_not_valid_and_mended_page_by_page) {
    for (uint8_t bad = 0; bad < 5; bad++) {
        fresh(5, true);
        other = program;
        other.bytes[bad * BOOT_PAGE_BYTES + 50] ^= 4;  // no frame's CRC found it
        begin();
        send_lap(&store, &other);
        work(&store);
        assert_int_equal(store.state, STORE_WRONG);
        assert_int_equal(reported_state(), BOOT_REPORT_WRONG);
        assert_int_equal(flash_starts(NULL, &program, false), STARTS_LOADER);
        send_lap(&store, &program);  // counts once
        assert_int_equal(store.state, STORE_WRONG);
        for (uint8_t page = 0; page < 6; page++)
            image_store_check_page(&store, page, page_crc(&program, page));
        work(&store);
        assert_int_equal(store.state, bad == 0 ? STORE_ANNOUNCED : STORE_LOADING);
        assert_int_equal(reported_state(), BOOT_REPORT_LOADING);
        assert_int_equal(missing(0), bad == 0 ? 31 : 1 << bad);
        send_lap(&store, &program);
        work(&store);
        assert_runs(&program);
    }
}

TEST(a_page_crc_concerns_complete_pages_of_an_image_that_is_being_loaded) {
    fresh(3, true);
    image_store_check_page(&store, 0, 1);
    begin();
    send_page(&store, &program, 1);
    send_fragment(&store, &program, 2, 0);
    for (uint8_t page = 0; page < 4; page++)
        if (page != 1) image_store_check_page(&store, page, 1);
    image_store_check_page(&store, 1, page_crc(&program, 1));
    assert_int_equal(missing(0), 5);
    image_store_check_page(&store, 1, (uint16_t)(page_crc(&program, 1) + 1));
    assert_int_equal(missing(0), 7);
    send_lap(&store, &program);
    work(&store);
    assert_runs(&program);
    const uint32_t before = flash_operations;
    image_store_check_page(&store, 1, 1);
    assert_int_equal(store.state, STORE_COMPLETE);
    assert_int_equal(flash_operations, before);
}

TEST(an_image_that_does_not_begin_with_a_jump_never_becomes_valid) {
    fresh(3, false);
    program.bytes[1] = 0x24;
    load(&store, &program);
    assert_int_equal(store.state, STORE_WRONG);
    send_lap(&store, &program);
    work(&store);
    assert_int_equal(flash_starts(NULL, &program, false), STARTS_LOADER);
    // Another one takes its place.
    program_make(&program, 3, 8, false);
    send_lap(&store, &program);
    work(&store);
    assert_runs(&program);
}

TEST(without_a_crc_a_fragment_of_another_image_with_as_many_pages_begins_anew) {
    for (uint8_t page = 0; page < 3; page++) {
        fresh(3, false);
        program_make(&other, 3, 44, false);
        begin();
        send_page(&store, &program, page);
        send_fragment(&store, &program, (uint8_t)((page + 1) % 3), 2);
        image_store_announce(&store, &other.image);  // no different
        assert_int_equal(store.state, STORE_LOADING);
        send_lap(&store, &other);
        work(&store);
        assert_runs(&other);
    }
}

TEST(an_image_that_is_there_already_is_complete_without_a_fragment) {
    fresh(9, true);
    flash_install(&program, true);
    image_store_announce(&store, &program.image);
    assert_int_equal(reported_state(), BOOT_REPORT_LOADING);
    assert_int_equal(missing(0), 0);
    work(&store);
    assert_int_equal(store.state, STORE_COMPLETE);
    send_lap(&store, &program);
    work(&store);
    assert_int_equal(flash_operations, 0);
    assert_runs(&program);
}

TEST(an_image_that_is_there_and_damaged_is_loaded) {
    fresh(9, true);
    flash_install(&program, true);
    flash[5 * BOOT_PAGE_BYTES + 3] ^= 1;
    image_store_announce(&store, &program.image);
    work(&store);
    assert_int_equal(store.state, STORE_ANNOUNCED);
    assert_int_equal(flash_operations, 0);
    send_lap(&store, &program);
    work(&store);
    assert_int_equal(store.state, STORE_COMPLETE);
    assert_runs(&program);
}

// A byte that differs from a blank page, behind the first fragment.
static int32_t byte_with_low_bit_clear(uint8_t page) {
    int32_t at = page * BOOT_PAGE_BYTES + BOOT_FRAGMENT_BYTES;
    while ((program.bytes[at] & 1) != 0) at++;
    return at;
}

TEST(a_page_that_does_not_take_what_is_written_is_missing_until_it_does) {
    for (uint8_t page = 0; page < 3; page++) {
        fresh(3, true);
        begin();
        flash_stuck_at = byte_with_low_bit_clear(page);
        for (int lap = 0; lap < 3; lap++) {
            send_lap(&store, &program);
            work(&store);
            assert_int_equal(store.state, STORE_LOADING);
            assert_true((missing(0) >> page & 1) != 0);
            assert_int_equal(flash_starts(NULL, &program, false), STARTS_LOADER);
        }
        flash_stuck_at = -1;
        send_lap(&store, &program);
        work(&store);
        assert_runs(&program);
    }
}

TEST(part_of_page_0_that_is_not_taken_begins_everything_anew) {
    fresh(3, true);
    begin();
    send_page(&store, &program, 2);
    flash_stuck_at = byte_with_low_bit_clear(0);
    for (uint8_t i = 0; i + 1 < BOOT_FRAGMENTS; i++) send_fragment(&store, &program, 0, i);
    send_fragment(&store, &program, 1, 0);
    assert_int_equal(store.state, STORE_ANNOUNCED);
    assert_int_equal(missing(0), 7);
    flash_stuck_at = -1;
    send_lap(&store, &program);
    work(&store);
    assert_runs(&program);
}

// Whatever cannot be erased keeps the loader waiting: the record, or page 1.
TEST(a_page_that_cannot_be_prepared_stops_everything) {
    const int32_t places[] = {BOOT_RECORD_PAGE * BOOT_PAGE_BYTES + 20, BOOT_PAGE_BYTES + 7};
    for (uint8_t i = 0; i < 2; i++) {
        fresh(9, true);
        program_make(&other, 9, 3, true);
        flash_install(&other, true);
        flash[places[i]] &= 0xFE;
        flash_stuck_at = places[i];
        image_store_announce(&store, &program.image);
        send_page(&store, &program, 0);
        assert_false(image_store_work(&store));
        assert_int_equal(store.state, STORE_ANNOUNCED);
        assert_int_equal(missing(0), 0x1FF);
        assert_int_equal(flash_starts(&other, &program, false), STARTS_LOADER);
        flash_stuck_at = -1;
        send_lap(&store, &program);
        work(&store);
        assert_runs(&program);
    }
}

TEST(a_page_behind_the_image_that_cannot_be_erased_keeps_it_from_being_valid) {
    fresh(9, true);
    program_make(&other, 12, 3, true);
    flash_install(&other, true);
    flash_stuck_at = 11 * BOOT_PAGE_BYTES + 20;
    flash[flash_stuck_at] &= 0xFE;
    image_store_announce(&store, &program.image);
    send_lap(&store, &program);
    for (int n = 0; n < 1000; n++) assert_true(image_store_work(&store));
    assert_int_equal(store.state, STORE_CHECKING);
    assert_int_equal(flash_starts(&other, &program, false), STARTS_LOADER);
    flash_stuck_at = -1;
    work(&store);
    assert_runs(&program);
}

TEST(a_record_that_cannot_be_written_is_tried_again) {
    fresh(3, true);
    begin();
    flash_stuck_at = BOOT_RECORD_PAGE * BOOT_PAGE_BYTES + 2;  // pages: 3
    flash[flash_stuck_at] = 0xFE;
    send_lap(&store, &program);
    for (int n = 0; n < 1000; n++) assert_true(image_store_work(&store));
    assert_int_equal(flash_starts(NULL, &program, false), STARTS_LOADER);
    flash_stuck_at = -1;
    work(&store);
    assert_runs(&program);
}

// Random order, a fifth lost, duplicates, and sometimes two laps mixed.
TEST(fragments_in_any_order_with_losses_over_laps_make_the_image) {
    uint32_t seed = 2026, laps_needed = 0;
    for (int trial = 0; trial < 60; trial++) {
        const uint8_t pages = (uint8_t)(1 + chance(&seed, trial % 4 == 0 ? BOOT_PAGES : 12));
        fresh(pages, chance(&seed, 2) != 0);
        begin();
        const uint32_t fragments = (uint32_t)pages * BOOT_FRAGMENTS;
        uint32_t laps = 0;
        while (store.state != STORE_COMPLETE) {
            assert_true(laps++ < 40);
            for (uint32_t n = 0; n < fragments; n++) {
                const uint32_t which = trial % 2 == 0 ? chance(&seed, fragments) : n;
                if (chance(&seed, 5) == 0) continue;
                send_fragment(&store, &program, (uint8_t)(which / BOOT_FRAGMENTS),
                              which % BOOT_FRAGMENTS);
                if (chance(&seed, 8) == 0) image_store_work(&store);
            }
            image_store_announce(&store, &program.image);
            work(&store);
        }
        if (trial % 2 != 0 && laps > laps_needed) laps_needed = laps;
        assert_runs(&program);
    }
    // In order: the last of 4,840 fragments is lost so often one after the other.
    assert_true(laps_needed <= 8);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(images_of_every_size_are_stored_and_valid),
        cmocka_unit_test(the_record_knows_the_crc_also_if_none_was_sent),
        cmocka_unit_test(an_image_of_no_pages_or_too_many_is_ignored),
        cmocka_unit_test(nothing_is_erased_before_a_fragment_of_an_announced_image),
        cmocka_unit_test(
            a_lap_over_an_old_program_is_enough_and_takes_two_operations_a_page_and_five),
        cmocka_unit_test(the_first_fragment_whichever_it_is_is_kept),
        cmocka_unit_test(what_lies_between_the_longest_application_and_the_record_is_erased),
        cmocka_unit_test(the_same_announcement_again_changes_nothing_and_another_one_begins_anew),
        cmocka_unit_test(another_image_in_the_middle_of_one_is_stored_alone),
        cmocka_unit_test(pages_are_reported_by_32_from_any_on),
        cmocka_unit_test(the_id_is_reported_of_what_is_announced_or_else_of_what_is_valid),
        cmocka_unit_test(fragments_that_come_twice_do_not_stand_in_for_those_that_were_lost),
        cmocka_unit_test(an_image_whose_crc_is_wrong_is_not_valid_and_mended_page_by_page),
        cmocka_unit_test(a_page_crc_concerns_complete_pages_of_an_image_that_is_being_loaded),
        cmocka_unit_test(an_image_that_does_not_begin_with_a_jump_never_becomes_valid),
        cmocka_unit_test(without_a_crc_a_fragment_of_another_image_with_as_many_pages_begins_anew),
        cmocka_unit_test(an_image_that_is_there_already_is_complete_without_a_fragment),
        cmocka_unit_test(an_image_that_is_there_and_damaged_is_loaded),
        cmocka_unit_test(a_page_that_does_not_take_what_is_written_is_missing_until_it_does),
        cmocka_unit_test(part_of_page_0_that_is_not_taken_begins_everything_anew),
        cmocka_unit_test(a_page_that_cannot_be_prepared_stops_everything),
        cmocka_unit_test(a_page_behind_the_image_that_cannot_be_erased_keeps_it_from_being_valid),
        cmocka_unit_test(a_record_that_cannot_be_written_is_tried_again),
        cmocka_unit_test(fragments_in_any_order_with_losses_over_laps_make_the_image),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
