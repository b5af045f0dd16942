/// The power goes after each single erase and write of a replacement: what starts then is the old
/// program, the new one or the loader, and from there a replacement succeeds.
#include <stdio.h>
#include <string.h>

#include "flash_model.h"

static image_store_t store;
static program_t older, newer;
static uint32_t cuts;

// Fragments out of order, some lost, over laps, so that pages are written in parts.
static void load_badly(uint32_t seed) {
    const uint32_t fragments = (uint32_t)newer.image.pages * BOOT_FRAGMENTS;
    image_store_announce(&store, &newer.image);
    work(&store);
    for (int lap = 0; lap < 40 && store.state != STORE_COMPLETE; lap++) {
        for (uint32_t n = 0; n < fragments; n++) {
            const uint32_t which = seed != 0 ? chance(&seed, fragments) : n;
            if (seed != 0 && chance(&seed, 5) == 0) continue;
            send_fragment(&store, &newer, (uint8_t)(which / BOOT_FRAGMENTS),
                          which % BOOT_FRAGMENTS);
        }
        work(&store);
    }
    if (store.state != STORE_COMPLETE) send_lap(&store, &newer);
    work(&store);
}

/// Flash before the replacement.
typedef enum { BLANK_CHIP, OURS, FOREIGN } before_t;

// Loads, and returns the operations that it takes; with `cut`, the power goes after so many.
static uint32_t load_until(uint32_t seed, uint32_t cut) {
    image_store_init(&store);
    flash_operations = 0;
    flash_power_goes_after = cut;
    if (setjmp(flash_power) == 0) {
        load_badly(seed);
        assert_int_equal(store.state, STORE_COMPLETE);
    }
    flash_power_goes_after = 0;
    return flash_operations;
}

static uint32_t replace(before_t before, uint32_t seed, uint32_t cut) {
    flash_erase_chip();
    if (before != BLANK_CHIP) flash_install(&older, before == OURS);
    return load_until(seed, cut);
}

static starts_t assert_whole(uint32_t cut) {
    const starts_t starts = flash_starts(&older, &newer, false);
    const starts_t by_boot_reset = flash_starts(&older, &newer, true);
    if (starts == STARTS_HALF || by_boot_reset == STARTS_HALF)
        fail_msg("after operation %u half a program starts", cut);
    return starts;
}

// RAM is gone, and the sender begins again.
static void assert_recovers(uint32_t cut) {
    memset(&store, 0x5A, sizeof store);
    image_store_init(&store);
    load(&store, &newer);
    if (store.state != STORE_COMPLETE || flash_starts(NULL, &newer, false) != STARTS_NEW)
        fail_msg("after operation %u no replacement succeeds", cut);
}

static void cut_after_each(before_t before, uint32_t seed) {
    const uint32_t operations = replace(before, seed, 0);
    starts_t last = STARTS_OLD;
    for (uint32_t cut = 1; cut <= operations; cut++, cuts++) {
        replace(before, seed, cut);
        last = assert_whole(cut);
        // The record goes first and comes last.
        assert_int_equal(last == STARTS_NEW, cut == operations);
        assert_int_not_equal(last, STARTS_OLD);
        assert_recovers(cut);
    }
}

TEST(after_each_operation_what_starts_is_whole) {
    const uint8_t sizes[][2] = {{1, 1}, {1, 9},   {9, 1},    {2, 2},
                                {9, 9}, {40, 40}, {220, 30}, {30, 220}};
    cuts = 0;
    for (uint8_t i = 0; i < sizeof sizes / 2; i++)
        for (uint32_t seed = 0; seed < (sizes[i][1] < 10 ? 4u : 1u); seed++)
            for (int checked = 0; checked < 2; checked++) {
                program_make(&older, sizes[i][0], 11 + i, true);
                program_make(&newer, sizes[i][1], 22 + i, checked != 0);
                cut_after_each(OURS, seed);
                cut_after_each(BLANK_CHIP, seed);
            }
    printf("%u power cuts\n", cuts);
    assert_true(cuts > 1000);
}

// Whatever a cut leaves, the next replacement begins with that, and is cut itself.
TEST(after_each_operation_of_a_replacement_that_follows_a_cut_what_starts_is_whole) {
    static uint8_t left[FLASH_BYTES];
    const uint8_t sizes[][2] = {{1, 1}, {1, 5}, {5, 1}, {2, 2}, {9, 7}};
    cuts = 0;
    for (uint8_t i = 0; i < sizeof sizes / 2; i++) {
        program_make(&older, sizes[i][0], 11 + i, true);
        program_make(&newer, sizes[i][1], 22 + i, true);
        const uint32_t operations = replace(OURS, 0, 0);
        for (uint32_t first = 1; first < operations; first++) {
            replace(OURS, 0, first);
            memcpy(left, flash, sizeof left);
            const uint32_t more = load_until(0, 0);
            for (uint32_t cut = 1; cut <= more; cut++, cuts++) {
                memcpy(flash, left, sizeof left);
                load_until(0, cut);
                assert_whole(cut);
            }
        }
    }
    printf("%u power cuts after a power cut\n", cuts);
    assert_true(cuts > 500);
}

TEST(random_replacements_cut_anywhere_leave_something_whole) {
    uint32_t seed = 7;
    for (int trial = 0; trial < 300; trial++) {
        program_make(&older, (uint8_t)(1 + chance(&seed, 40)), seed, chance(&seed, 2) != 0);
        program_make(&newer, (uint8_t)(1 + chance(&seed, 40)), seed + 1, chance(&seed, 2) != 0);
        const uint32_t order = chance(&seed, 3) == 0 ? 0 : 1 + chance(&seed, 1000);
        const uint32_t operations = replace(OURS, order, 0);
        const uint32_t cut = 1 + chance(&seed, operations);
        replace(OURS, order, cut);
        assert_whole(cut);
        assert_recovers(cut);
    }
}

TEST(pages_that_are_dropped_and_come_again_leave_no_window) {
    program_make(&older, 9, 1, true);
    program_make(&newer, 5, 2, true);
    static program_t damaged;
    for (uint8_t bad = 0; bad < 5; bad++)
        for (uint32_t cut = 1; cut < 60; cut++) {
            damaged = newer;
            damaged.bytes[bad * BOOT_PAGE_BYTES + 9] ^= 1;
            flash_erase_chip();
            flash_install(&older, true);
            image_store_init(&store);
            flash_power_goes_after = cut;
            if (setjmp(flash_power) == 0) {
                load(&store, &damaged);
                for (uint8_t page = 0; page < 5; page++)
                    image_store_check_page(
                        &store, page,
                        plain_crc(newer.bytes + page * BOOT_PAGE_BYTES, BOOT_PAGE_BYTES));
                work(&store);
                send_lap(&store, &newer);
                work(&store);
                assert_int_equal(store.state, STORE_COMPLETE);
            }
            flash_power_goes_after = 0;
            assert_whole(cut);
            assert_recovers(cut);
        }
}

// boot_loaders.md 4: such a chip has one window, between erasing page 0 and writing it.
TEST(a_program_that_avrdude_alone_put_there_has_one_window_and_no_other) {
    program_make(&older, 30, 5, true);
    program_make(&newer, 20, 6, true);
    const uint32_t operations = replace(FOREIGN, 0, 0);
    uint32_t windows = 0;
    for (uint32_t cut = 1; cut <= operations; cut++) {
        replace(FOREIGN, 0, cut);
        const bool half = flash_starts(&older, &newer, false) == STARTS_HALF;
        windows += half;
        assert_int_equal(half, cut == 1);
        assert_int_not_equal(flash_starts(&older, &newer, true), STARTS_HALF);
        assert_recovers(cut);
    }
    assert_int_equal(windows, 1);
}

TEST(a_record_without_its_program_does_not_start_another_one) {
    program_make(&older, 30, 5, true);
    program_make(&newer, 20, 6, true);
    // avrdude wrote a program and left the record of the one before it.
    flash_erase_chip();
    flash_install(&older, true);
    memcpy(flash, newer.bytes, sizeof newer.bytes);
    assert_int_equal(flash_starts(NULL, &newer, false), STARTS_NEW);
    image_store_init(&store);
    for (uint32_t cut = 2; cut < 40; cut++) {
        flash_erase_chip();
        flash_install(&older, true);
        memcpy(flash, newer.bytes, sizeof newer.bytes);
        image_store_init(&store);
        flash_power_goes_after = cut;
        if (setjmp(flash_power) == 0) load(&store, &older);
        flash_power_goes_after = 0;
        // Operation 1 erases the record, 2 page 0.
        if (cut != 2) assert_whole(cut);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(after_each_operation_what_starts_is_whole),
        cmocka_unit_test(
            after_each_operation_of_a_replacement_that_follows_a_cut_what_starts_is_whole),
        cmocka_unit_test(random_replacements_cut_anywhere_leave_something_whole),
        cmocka_unit_test(pages_that_are_dropped_and_come_again_leave_no_window),
        cmocka_unit_test(a_program_that_avrdude_alone_put_there_has_one_window_and_no_other),
        cmocka_unit_test(a_record_without_its_program_does_not_start_another_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
