/// The image record and the reset vector.
#include "bootloader/core/image_record.h"

#include <string.h>

#include "flash_model.h"

static program_t program;

static void put_vector(uint8_t *vector, uint16_t first, uint16_t second) {
    vector[0] = (uint8_t)first;
    vector[1] = (uint8_t)(first >> 8);
    vector[2] = (uint8_t)second;
    vector[3] = (uint8_t)(second >> 8);
}

static uint16_t entry(uint16_t first, uint16_t second, uint8_t pages) {
    uint8_t vector[BOOT_VECTOR_BYTES];
    put_vector(vector, first, second);
    return image_entry(vector, pages);
}

TEST(a_jump_into_the_image_is_an_entry) {
    assert_int_equal(entry(0x940C, 0x0034, 1), 0x34);
    assert_int_equal(entry(0x940C, 2, 1), 2);
    assert_int_equal(entry(0x940C, 63, 1), 63);
    assert_int_equal(entry(0x940C, 220 * 64 - 1, 220), 220 * 64 - 1);
    assert_int_equal(entry(0xC001, 0xFFFF, 1), 2);
    assert_int_equal(entry(0xC03E, 0xFFFF, 1), 63);
    assert_int_equal(entry(0xC7FF, 0x1234, 220), 0x800);
}

TEST(what_is_no_jump_or_leads_out_of_the_image_is_none) {
    assert_int_equal(entry(0x940C, 64, 1), IMAGE_NO_ENTRY);
    assert_int_equal(entry(0x940C, 0, 1), IMAGE_NO_ENTRY);
    assert_int_equal(entry(0x940C, 1, 1), IMAGE_NO_ENTRY);
    assert_int_equal(entry(0x940C, 0x3802, 220), IMAGE_NO_ENTRY);  // the loader's own
    assert_int_equal(entry(0x940D, 0x34, 1), IMAGE_NO_ENTRY);      // beyond 64 K words
    assert_int_equal(entry(0x940E, 0x34, 1), IMAGE_NO_ENTRY);      // a call
    assert_int_equal(entry(0xC000, 0xFFFF, 1), IMAGE_NO_ENTRY);    // into the loader's vector
    assert_int_equal(entry(0xCFFF, 0xFFFF, 220), IMAGE_NO_ENTRY);  // to itself
    assert_int_equal(entry(0xCF00, 0xFFFF, 220), IMAGE_NO_ENTRY);  // backwards, to the flash's end
    assert_int_equal(entry(0xC03F, 0xFFFF, 1), IMAGE_NO_ENTRY);
    assert_int_equal(entry(0xFFFF, 0xFFFF, 220), IMAGE_NO_ENTRY);
    assert_int_equal(entry(0x0000, 0x0000, 220), IMAGE_NO_ENTRY);
}

TEST(a_sealed_record_is_read_as_it_was) {
    image_record_t record, found;
    flash_erase_chip();
    program_make(&program, 7, 1, true);
    flash_install(&program, true);
    assert_true(image_record_read(&found));
    memset(&record, 0, sizeof record);
    record.image = program.image;
    memcpy(record.vector, program.bytes, BOOT_VECTOR_BYTES);
    image_record_seal(&record);
    assert_memory_equal(&record, &found, sizeof record);
    assert_int_equal(image_application_entry(), 64);
}

TEST(no_flipped_bit_of_the_record_or_the_vector_leaves_it_valid) {
    image_record_t record;
    program_make(&program, 7, 2, true);
    for (uint32_t bit = 0; bit < 20 * 8; bit++) {
        const uint32_t byte = bit / 8;
        flash_install(&program, true);
        flash[byte < 16 ? BOOT_RECORD_PAGE * BOOT_PAGE_BYTES + byte : byte - 16] ^= 1 << bit % 8;
        assert_false(image_record_read(&record));
    }
}

TEST(a_record_whose_vector_leads_nowhere_is_not_valid) {
    image_record_t record;
    program_make(&program, 7, 3, true);
    put_vector(program.bytes, 0x2411, 0xBE1F);
    flash_install(&program, true);
    assert_false(image_record_read(&record));
    assert_int_equal(image_application_entry(), IMAGE_NO_ENTRY);
}

TEST(a_blank_chip_has_no_application) {
    flash_erase_chip();
    assert_int_equal(image_application_entry(), IMAGE_NO_ENTRY);
    assert_false(image_vector_is_loaders());
}

TEST(an_application_that_avrdude_alone_put_there_starts_at_0) {
    program_make(&program, 7, 4, true);
    flash_install(&program, false);
    assert_int_equal(image_application_entry(), 0);
}

TEST(the_loaders_vector_without_a_record_leads_to_no_application) {
    program_make(&program, 7, 5, true);
    flash_install(&program, true);
    boot_flash_erase(BOOT_RECORD_PAGE);
    assert_true(image_vector_is_loaders());
    assert_int_equal(image_application_entry(), IMAGE_NO_ENTRY);
    flash[2] = 0;  // a jmp, but another one
    assert_false(image_vector_is_loaders());
}

TEST(the_records_first_word_jumps_over_its_page) {
    image_record_t record;
    memset(&record, 0, sizeof record);
    image_record_seal(&record);
    // rjmp: 63 words beyond the next one.
    assert_int_equal(record.slide, 0xC03F);
    assert_int_equal(BOOT_RECORD_PAGE * BOOT_PAGE_BYTES + 2 * (1 + 63), BOOT_LOADER_ADDRESS);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_jump_into_the_image_is_an_entry),
        cmocka_unit_test(what_is_no_jump_or_leads_out_of_the_image_is_none),
        cmocka_unit_test(a_sealed_record_is_read_as_it_was),
        cmocka_unit_test(no_flipped_bit_of_the_record_or_the_vector_leaves_it_valid),
        cmocka_unit_test(a_record_whose_vector_leads_nowhere_is_not_valid),
        cmocka_unit_test(a_blank_chip_has_no_application),
        cmocka_unit_test(an_application_that_avrdude_alone_put_there_starts_at_0),
        cmocka_unit_test(the_loaders_vector_without_a_record_leads_to_no_application),
        cmocka_unit_test(the_records_first_word_jumps_over_its_page),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
