/// Lights of a robot and the rhythm of its sleep, against stepping through them.
#include "../../firmware/support.h"
#include "kilolib/core/lights.h"
#include "kilolib/core/pins.h"
#include "kilolib/core/sleep_rhythm.h"

#define MS ((uint64_t)CYCLES_PER_MS)

TEST(an_idle_robot_blinks_for_1_ms_each_201_2_ms) {
    uint32_t on = 0, begins = 0;
    bool was_on = false;
    const uint64_t step = 800;  // 0.1 ms
    for (uint64_t at = 0; at < 10 * BLINK_PERIOD_CYCLES; at += step) {
        const bool is_on = blink_is_on(at);
        on += is_on;
        begins += is_on && !was_on;
        was_on = is_on;
    }
    assert_int_equal(begins, 10);
    assert_int_equal(on, 10 * MS / step);
}

TEST(the_battery_has_four_colours) {
    for (int16_t voltage = 0; voltage <= 1023; voltage++) {
        const uint8_t expected = voltage >= 683   ? RGB(0, 3, 0)
                                 : voltage >= 649 ? RGB(0, 0, 3)
                                 : voltage >= 615 ? RGB(3, 3, 0)
                                                  : RGB(3, 0, 0);
        assert_int_equal(battery_color(voltage), expected);
    }
}

TEST(pins_and_colours_are_each_others_inverse) {
    for (int rgb = 0; rgb < 64; rgb++) {
        const led_pins_t on = led_pins((uint8_t)rgb);
        assert_int_equal(on.ddrc & ~LED_MASK_C, 0);
        assert_int_equal(on.ddrd & ~LED_MASK_D, 0);
        assert_int_equal(led_color(on.ddrc, on.ddrd), rgb);
        assert_int_equal(led_color(on.ddrc | (uint8_t)~LED_MASK_C, on.ddrd | (uint8_t)~LED_MASK_D),
                         rgb);
    }
    assert_int_equal(led_pins(1).ddrd, 1 << 5);  // red's weak pin is PD5
    assert_int_equal(led_pins(4).ddrc, 1 << 3);
    assert_int_equal(led_pins(16).ddrc, 1 << 5);
}

TEST(a_sleeping_robot_looks_round_each_8_2_s) {
    const uint64_t asleep = 5000, step = MS / 10;
    uint32_t white = 0, received = 0;
    for (uint64_t at = asleep; at < asleep + 3 * SLEEP_PERIOD_CYCLES; at += step) {
        const uint8_t color = sleep_rhythm_color(asleep, at);
        assert_true(color == 0 || color == SLEEP_LISTEN_COLOR);
        white += color != 0;
        uint64_t down_since = asleep;
        received += sleep_rhythm_receives(asleep, &down_since, at);
    }
    assert_int_equal(white, 3 * 100);
    assert_int_equal(received, 3 * 103);  // from the begin of the settling on
    assert_int_equal(SLEEP_PERIOD_CYCLES, (8192 + 10) * MS + 300 * 8);
}

TEST(a_frame_in_the_look_round_keeps_it_awake_lit_red) {
    uint64_t down_since = 0;
    const uint64_t look = SLEEP_PERIOD_CYCLES + SLEEP_LISTEN_FROM;
    assert_true(sleep_rhythm_receives(0, &down_since, look + 1));
    const uint64_t end = 2 * SLEEP_PERIOD_CYCLES + 100 * MS;
    assert_int_equal(down_since, end);
    assert_int_equal(sleep_rhythm_color(down_since, end - 1), SLEEP_LISTEN_ON_COLOR);
    assert_int_equal(sleep_rhythm_color(down_since, end), 0);
    assert_true(sleep_rhythm_receives(0, &down_since, end - 1));
    assert_false(sleep_rhythm_receives(0, &down_since, end));
    assert_false(sleep_rhythm_receives(0, &down_since, end + SLEEP_DOWN_CYCLES - 1));
    assert_true(sleep_rhythm_receives(0, &down_since, end + SLEEP_DOWN_CYCLES));
    assert_int_equal(down_since, end);  // settling: received, but no reason to stay
}

TEST(frames_that_began_before_it_slept_are_lost) {
    uint64_t down_since = 1000 * MS;
    assert_false(sleep_rhythm_receives(1000 * MS, &down_since, 999 * MS));
    assert_false(sleep_rhythm_receives(1000 * MS, &down_since, 1000 * MS));
    assert_int_equal(down_since, 1000 * MS);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_idle_robot_blinks_for_1_ms_each_201_2_ms),
        cmocka_unit_test(the_battery_has_four_colours),
        cmocka_unit_test(pins_and_colours_are_each_others_inverse),
        cmocka_unit_test(a_sleeping_robot_looks_round_each_8_2_s),
        cmocka_unit_test(a_frame_in_the_look_round_keeps_it_awake_lit_red),
        cmocka_unit_test(frames_that_began_before_it_slept_are_lost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
