/// Distances from gains, against the same rule in floating point.
#include "kilolib/core/gains.h"

#include "../../firmware/support.h"

// As a robot of this sensitivity has them: 1/e in 25 mm, and five times as much at the high gain.
static gain_tables_t falling_tables(double sensitivity) {
    gain_tables_t tables;
    for (int i = 0; i < GAIN_ENTRIES; i++) {
        const double low = 900 * sensitivity * exp(-5.0 * i / 25);
        tables.low[i] = (uint16_t)fmin(low + 0.5, CONVERTER_MOST);
        tables.high[i] = (uint16_t)fmin(5 * low + 0.5, CONVERTER_MOST);
    }
    return tables;
}

static double exactly(const uint16_t *table, double gain) {
    int i = 1;
    while (i + 1 < GAIN_ENTRIES && gain < table[i]) i++;
    const double fall = fmax((double)table[i - 1] - table[i], 1);
    return 33 + 5 * (i - 1 + (table[i - 1] - gain) / fall);
}

static uint8_t expected_mm(const gain_tables_t *tables, int16_t low, int16_t high) {
    const double share = fmin(fmax((900.0 - high) / 200, 0), 1);
    double mm = 0;
    if (share > 0) mm += share * exactly(tables->high, high);
    if (share < 1) mm += (1 - share) * exactly(tables->low, low);
    return (uint8_t)fmin(fmax(mm + 1e-9, 33), 255);
}

TEST(every_reading_of_every_robot_has_the_distance_of_the_rule) {
    static const double SENSITIVITIES[] = {1, 0.83, 1.13};
    for (int robot = 0; robot < 3; robot++) {
        const gain_tables_t tables = falling_tables(SENSITIVITIES[robot]);
        for (int16_t high = 0; high <= CONVERTER_MOST; high++) {
            for (int16_t low = 0; low <= CONVERTER_MOST; low++) {
                const distance_measurement_t measured = {low, high};
                const uint8_t mm = kilolib_gains_distance(&tables, &measured);
                if (mm != expected_mm(&tables, low, high)) fail_msg("%d %d: %d", low, high, mm);
                if (high <= 700) break;  // the low gain does not count
            }
        }
    }
}

TEST(tables_of_an_erased_eeprom_do_no_harm) {
    gain_tables_t tables;
    for (int i = 0; i < GAIN_ENTRIES; i++) tables.low[i] = tables.high[i] = CONVERTER_MOST;
    for (int16_t gain = 0; gain <= CONVERTER_MOST; gain++) {
        const distance_measurement_t measured = {gain, gain};
        assert_true(kilolib_gains_distance(&tables, &measured) >= 33);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_reading_of_every_robot_has_the_distance_of_the_rule),
        cmocka_unit_test(tables_of_an_erased_eeprom_do_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
