#include "cell.h"

#include "../../../firmware/aggregation/wire.h"
#include "support.h"

#define RED 1
#define GREEN 2
#define BLUE 4
#define WHITE 7

static void assert_cell(cell_t cell, uint8_t site, uint8_t flags, uint8_t colour,
                        uint8_t brightness) {
    assert_true(cell.speaks);
    assert_int_equal(cell.site, site);
    assert_int_equal(cell.flags, flags);
    assert_int_equal(cell.colour, colour);
    assert_int_equal(cell.brightness, brightness);
}

static void assert_silent(cell_t cell) {
    assert_false(cell.speaks);
    assert_int_equal(cell.site, 0);
    assert_int_equal(cell.colour, 0);
    assert_int_equal(cell.brightness, 0);
}

static cell_t of_code(uint8_t code) { return cell_of(&code, 1, 0); }

TEST(the_labs_codes_mean_what_they_mean_there) {
    const uint8_t configuration[] = {1, 2, 3, 4};
    assert_cell(cell_of(configuration, 4, 0), 0, WIRE_CELL_WALL, RED, 240);
    assert_cell(cell_of(configuration, 4, 1), 0, 0, BLUE, 240);
    assert_cell(cell_of(configuration, 4, 2), 1, 0, WHITE, 240);
    assert_cell(cell_of(configuration, 4, 3), 2, 0, 0, 240);
}

TEST(the_next_four_codes_are_further_sites_in_further_colours) {
    assert_cell(of_code(5), 3, 0, GREEN, 240);
    assert_cell(of_code(6), 4, 0, RED | GREEN, 240);
    assert_cell(of_code(7), 5, 0, GREEN | BLUE, 240);
    assert_cell(of_code(8), 6, 0, RED | BLUE, 240);
}

TEST(cells_that_nobody_explains_are_silent) {
    const uint8_t configuration[] = {0, 9, 0x7F, 1, 1};
    for (uint8_t cell = 0; cell < 3; cell++) assert_silent(cell_of(configuration, 5, cell));
    assert_silent(cell_of(configuration, 5, 4));  // there are four
    assert_silent(cell_of(configuration, 2, 2));  // not told
    assert_silent(cell_of(NULL, 0, 0));
}

TEST(a_full_code_holds_site_and_colour) {
    for (uint8_t site = 0; site < 15; site++)
        for (uint8_t colour = 0; colour < 8; colour++)
            assert_cell(of_code((uint8_t)(0x80 | colour << 4 | site)), site, 0, colour, 240);
    assert_cell(of_code(0x8F | RED << 4), 0, WIRE_CELL_WALL, RED, 240);
}

TEST(a_table_says_what_its_codes_mean_and_leaves_the_others) {
    const uint8_t configuration[] = {1, 2, 3, 0x95, 200, 2, 0x10, 0, 0x08 | BLUE, 255};
    assert_cell(cell_of(configuration, sizeof configuration, 0), 200, 0, GREEN, 16);
    assert_cell(cell_of(configuration, sizeof configuration, 1), 0, WIRE_CELL_WALL, BLUE, 255);
    assert_cell(cell_of(configuration, sizeof configuration, 2), 1, 0, WHITE, 240);
    assert_cell(cell_of(configuration, sizeof configuration, 3), 5, 0, RED, 240);
    // A last entry of two bytes is none.
    assert_cell(cell_of(configuration, sizeof configuration - 1, 1), 0, 0, BLUE, 240);
}

TEST(the_largest_configuration_explains_codes_up_to_14) {
    uint8_t configuration[48] = {13, 14, 15, 1};
    for (uint8_t code = 1; code <= 14; code++) {
        configuration[4 + 3 * (code - 1)] = code;
        configuration[4 + 3 * (code - 1) + 2] = 1;
    }
    assert_cell(cell_of(configuration, 48, 0), 13, 0, 0, 1);
    assert_cell(cell_of(configuration, 48, 1), 14, 0, 0, 1);
    assert_silent(cell_of(configuration, 48, 2));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_labs_codes_mean_what_they_mean_there),
        cmocka_unit_test(the_next_four_codes_are_further_sites_in_further_colours),
        cmocka_unit_test(cells_that_nobody_explains_are_silent),
        cmocka_unit_test(a_full_code_holds_site_and_colour),
        cmocka_unit_test(a_table_says_what_its_codes_mean_and_leaves_the_others),
        cmocka_unit_test(the_largest_configuration_explains_codes_up_to_14),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
