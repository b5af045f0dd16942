#include "core_support.h"
#include "runtime/core/light_patterns.h"

TEST(the_show_lights_and_darkens_cell_by_cell_in_three_colours) {
    static const uint8_t COLORS[] = {1, 2, 4};
    uint8_t shown[4] = {0, 0, 0, 0};
    for (uint8_t step = 0; step < 24; step++) {
        const uint8_t cell = pattern_show_cell(step);
        shown[cell] = step % 8 < 4 ? COLORS[step / 8] : 0;
        for (uint8_t i = 0; i < 4; i++) assert_int_equal(pattern_show_color(step, i), shown[i]);
    }
    assert_int_equal(SHOW_STEPS, 24);
}

TEST(breathing_rises_and_falls_step_by_step) {
    assert_int_equal(pattern_breath(0), 0);
    assert_int_equal(pattern_breath(20), 20);
    for (uint8_t step = 0; step < 40; step++)
        assert_int_equal(abs(pattern_breath((uint8_t)((step + 1) % 40)) - pattern_breath(step)), 1);
}

TEST(a_part_of_a_colour_is_lit_if_its_bit_is_set) {
    for (uint8_t color = 0; color < 8; color++)
        for (uint8_t part = 0; part < 3; part++)
            assert_int_equal(color_part(color, 99, part), color & 1 << part ? 99 : 0);
}

TEST(commands_have_the_colours_of_the_specification) {
    static const uint8_t COLORS[][2] = {{0x83, 2}, {0x80, 4}, {0x81, 6}, {0x82, 6},
                                        {0x84, 7}, {0x88, 5}, {0x86, 1}, {0x87, 3},
                                        {0x8A, 3}, {0x7D, 3}, {0x7E, 3}, {0x7F, 3}};
    for (int type = 0; type < 256; type++) {
        uint8_t color = 0;
        for (size_t i = 0; i < sizeof COLORS / sizeof *COLORS; i++)
            if (COLORS[i][0] == type) color = COLORS[i][1];
        assert_int_equal(pattern_command_color((uint8_t)type), color);
    }
}

TEST(pages_alternate_between_blue_and_green) {
    assert_int_equal(pattern_page_color(0), 4);
    assert_int_equal(pattern_page_color(1), 2);
    assert_int_equal(pattern_page_color(2), 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_show_lights_and_darkens_cell_by_cell_in_three_colours),
        cmocka_unit_test(breathing_rises_and_falls_step_by_step),
        cmocka_unit_test(a_part_of_a_colour_is_lit_if_its_bit_is_set),
        cmocka_unit_test(commands_have_the_colours_of_the_specification),
        cmocka_unit_test(pages_alternate_between_blue_and_green),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
