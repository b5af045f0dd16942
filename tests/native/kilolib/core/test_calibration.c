/// Calibration: what goes between the EEPROM, the API's variables and a CALIB message.
#include "kilolib/core/calibration.h"

#include <setjmp.h>
#include <string.h>

#include "../../firmware/support.h"
#include "kilolib.h"
#include "kilolib/core/eeprom_map.h"
#include "kilolib/core/gains.h"

static uint8_t eeprom[EEPROM_BYTES];
static int written;          // bytes that differed, so far
static int power_ends = -1;  // after so many of them; -1: never
static bool tears_last;      // the cut hits the last byte itself: it is neither old nor new
static jmp_buf power_cut;

uint8_t kilolib_eeprom_read(uint16_t address) { return eeprom[address]; }

void kilolib_eeprom_update(uint16_t address, uint8_t value) {
    if (eeprom[address] == value) return;
    if (written == power_ends) {
        if (tears_last) eeprom[address] ^= 0x5A;
        longjmp(power_cut, 1);
    }
    written++;
    eeprom[address] = value;
}

TEST(the_variables_are_what_the_eeprom_holds) {
    memset(eeprom, 0, sizeof eeprom);
    eeprom[0xB0] = 0x34;
    eeprom[0xB1] = 0x12;
    eeprom[0x05] = 61;
    eeprom[0x09] = 62;
    eeprom[0x0C] = 63;
    eeprom[0x14] = 64;
    kilolib_calibration_load();
    assert_int_equal(kilo_uid, 0x1234);
    assert_int_equal(kilo_turn_left, 61);
    assert_int_equal(kilo_turn_right, 62);
    assert_int_equal(kilo_straight_left, 63);
    assert_int_equal(kilo_straight_right, 64);
}

TEST(an_erased_eeprom_gives_65535_and_255) {
    memset(eeprom, 0xFF, sizeof eeprom);
    kilolib_calibration_load();
    assert_int_equal(kilo_uid, 65535);
    assert_int_equal(kilo_turn_left, 255);
    assert_int_equal(kilo_straight_right, 255);
}

// The values of robots in these tests: uid, turn left and right, straight left and right.
enum { VALUES = 5 };
typedef struct {
    uint16_t of[VALUES];
} values_t;

static const values_t OLD = {{0x1234, 61, 62, 63, 64}}, NEW = {{0xABCD, 81, 82, 83, 84}};

static void save(const values_t *values) {
    const uint16_t *v = values->of;
    const uint8_t data[9] = {CALIBRATION_SAVE, (uint8_t)v[0], (uint8_t)(v[0] >> 8), (uint8_t)v[1],
                             (uint8_t)v[2],    (uint8_t)v[3], (uint8_t)v[4]};
    kilolib_calibration_save(data);
}

// Places that the original and its controllers read.
static values_t in_the_originals_places(void) {
    const values_t values = {{(uint16_t)(eeprom[0xB0] | eeprom[0xB1] << 8), eeprom[0x05],
                              eeprom[0x09], eeprom[0x0C], eeprom[0x14]}};
    return values;
}

static values_t in_the_variables(void) {
    const values_t values = {
        {kilo_uid, kilo_turn_left, kilo_turn_right, kilo_straight_left, kilo_straight_right}};
    return values;
}

static bool same(values_t one, const values_t *other) {
    return memcmp(&one, other, sizeof one) == 0;
}

// Saves, and loses power after `bytes` that were written. True if it did not get that far.
static bool save_with_a_cut(const values_t *values, int bytes, bool tears) {
    written = 0;
    power_ends = bytes;
    tears_last = tears;
    const bool cut = setjmp(power_cut) != 0;
    if (!cut) save(values);
    power_ends = -1;
    return !cut;
}

static void start_with(const values_t *values, int saves) {
    memset(eeprom, 0xFF, sizeof eeprom);
    for (int i = 0; i < saves; i++) {
        const values_t earlier = {{(uint16_t)i, 1, 2, 3, 4}};
        save(&earlier);
    }
    save(values);
}

TEST(saving_fills_the_originals_places_and_loads_them) {
    memset(eeprom, 0xFF, sizeof eeprom);
    save(&NEW);
    assert_true(same(in_the_originals_places(), &NEW));
    assert_true(same(in_the_variables(), &NEW));
}

TEST(saving_touches_nothing_but_its_own_places) {
    memset(eeprom, 0xFF, sizeof eeprom);
    for (int i = 0; i < 2; i++) save(i == 0 ? &OLD : &NEW);
    static const int PLACES[] = {0x05, 0x09, 0x0C, 0x14, 0xB0, 0xB1};
    for (size_t i = 0; i < sizeof PLACES / sizeof *PLACES; i++) eeprom[PLACES[i]] = 0xFF;
    memset(eeprom + EEPROM_RECORD_1, 0xFF, 10);
    memset(eeprom + EEPROM_RECORD_2, 0xFF, 10);
    for (int i = 0; i < EEPROM_BYTES; i++) assert_int_equal(eeprom[i], 0xFF);
}

// 300 saves: sequence numbers go round.
TEST(a_power_cut_at_any_byte_leaves_the_old_or_the_new_values) {
    static const int EARLIER[] = {0, 1, 127, 128, 254, 255, 256, 299};
    for (size_t e = 0; e < sizeof EARLIER / sizeof *EARLIER; e++) {
        for (int tears = 0; tears < 2; tears++) {
            int cuts = 0, old = 0;
            for (bool over = false; !over; cuts++) {
                start_with(&OLD, EARLIER[e]);
                over = save_with_a_cut(&NEW, cuts, tears != 0);
                kilolib_calibration_load();
                const bool is_new = same(in_the_variables(), &NEW);
                assert_true(is_new || same(in_the_variables(), &OLD));
                const values_t loaded = in_the_variables();
                assert_true(same(in_the_originals_places(), &loaded));
                if (!is_new) old++;
            }
            assert_true(cuts > 15);
            assert_true(old > 5 && old < cuts - 6);
        }
    }
}

TEST(a_power_cut_in_the_start_after_a_power_cut_harms_nothing) {
    for (int first = 0;; first++) {
        start_with(&OLD, 2);
        if (save_with_a_cut(&NEW, first, false)) break;
        uint8_t after_the_first[EEPROM_BYTES];
        memcpy(after_the_first, eeprom, sizeof eeprom);
        kilolib_calibration_load();
        const values_t expected = in_the_variables();
        for (int second = 0, over = 0; over == 0; second++) {
            memcpy(eeprom, after_the_first, sizeof eeprom);
            written = 0;
            power_ends = second;
            if (setjmp(power_cut) == 0) {
                kilolib_calibration_load();
                over = 1;
            }
            power_ends = -1;
            kilolib_calibration_load();
            assert_true(same(in_the_variables(), &expected));
        }
    }
}

TEST(what_another_program_has_changed_since_holds) {
    start_with(&NEW, 3);
    eeprom[0x05] = 77;
    kilolib_calibration_load();
    assert_int_equal(kilo_turn_left, 77);
    assert_int_equal(kilo_turn_right, 82);
}

TEST(records_that_are_no_records_change_nothing) {
    uint32_t state = 1;
    for (int round = 0; round < 1000; round++) {
        for (int i = 0; i < EEPROM_BYTES; i++) {
            state = state * 1664525 + 1013904223;
            eeprom[i] = (uint8_t)(state >> 24);
        }
        eeprom[EEPROM_RECORD_1 + 9] = eeprom[EEPROM_RECORD_2 + 9] = 0xB4;  // pending, so it says
        const values_t before = in_the_originals_places();
        kilolib_calibration_load();
        assert_true(same(in_the_variables(), &before));
        save(&NEW);
        assert_true(same(in_the_variables(), &NEW));
    }
}

TEST(the_values_before_the_last_ones_stay_in_the_other_record) {
    start_with(&OLD, 0);
    save(&NEW);
    assert_int_equal(eeprom[EEPROM_RECORD_2 + 3], OLD.of[1]);
    assert_int_equal(eeprom[EEPROM_RECORD_1 + 3], NEW.of[1]);
}

// An entry of the gain tables, as CALIB carries it: low gain, high gain, upper bytes first.
typedef struct {
    uint8_t bytes[4];
} entry_t;

static const entry_t OLD_ENTRY = {{0x03, 0x84, 0x03, 0xFF}}, NEW_ENTRY = {{0x01, 0x2C, 0x02, 0x9B}};

static void save_entry(int entry, const entry_t *to) {
    uint8_t data[9] = {(uint8_t)(CALIBRATION_GAINS + entry), 0x34, 0x12};
    memcpy(data + CALIB_TURN_LEFT, to->bytes, sizeof to->bytes);
    kilolib_calibration_save(data);
}

// By the original's places.
static entry_t entry_at(int entry) {
    entry_t found;
    memcpy(found.bytes, eeprom + 0x20 + 2 * entry, 2);
    memcpy(found.bytes + 2, eeprom + 0x50 + 2 * entry, 2);
    return found;
}

static bool is_entry(int entry, const entry_t *expected) {
    const entry_t found = entry_at(entry);
    return memcmp(&found, expected, sizeof found) == 0;
}

static void start_with_tables(void) {
    start_with(&OLD, 3);
    for (int entry = 0; entry < GAIN_ENTRIES; entry++) save_entry(entry, &OLD_ENTRY);
}

TEST(saving_an_entry_of_the_tables_changes_nothing_else) {
    for (int entry = 0; entry < GAIN_ENTRIES; entry++) {
        start_with_tables();
        save_entry(entry, &NEW_ENTRY);
        for (int other = 0; other < GAIN_ENTRIES; other++)
            assert_true(is_entry(other, other == entry ? &NEW_ENTRY : &OLD_ENTRY));
        assert_true(same(in_the_variables(), &OLD));
        assert_true(same(in_the_originals_places(), &OLD));
        entry_t told;
        kilolib_calibration_gains((uint8_t)(CALIBRATION_GAINS + entry), told.bytes);
        assert_memory_equal(&told, &NEW_ENTRY, sizeof told);
    }
}

TEST(an_entry_beyond_the_tables_is_not_written) {
    start_with_tables();
    uint8_t before[EEPROM_RECORD_1];
    memcpy(before, eeprom, sizeof before);
    save_entry(GAIN_ENTRIES, &NEW_ENTRY);
    assert_memory_equal(eeprom, before, sizeof before);
}

TEST(a_power_cut_at_any_byte_leaves_the_old_or_the_new_entry) {
    for (int tears = 0; tears < 2; tears++) {
        int cuts = 0, old = 0;
        for (bool over = false; !over; cuts++) {
            start_with_tables();
            written = 0;
            power_ends = cuts;
            tears_last = tears != 0;
            if (setjmp(power_cut) == 0) {
                save_entry(5, &NEW_ENTRY);
                over = true;
            }
            power_ends = -1;
            kilolib_calibration_load();
            assert_true(is_entry(5, &OLD_ENTRY) || is_entry(5, &NEW_ENTRY));
            old += is_entry(5, &OLD_ENTRY);
            for (int other = 0; other < GAIN_ENTRIES; other++)
                assert_true(other == 5 || is_entry(other, &OLD_ENTRY));
            assert_true(same(in_the_variables(), &OLD));
        }
        assert_true(cuts > 10);
        assert_true(old > 4 && old < cuts - 4);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_variables_are_what_the_eeprom_holds),
        cmocka_unit_test(an_erased_eeprom_gives_65535_and_255),
        cmocka_unit_test(saving_fills_the_originals_places_and_loads_them),
        cmocka_unit_test(saving_touches_nothing_but_its_own_places),
        cmocka_unit_test(a_power_cut_at_any_byte_leaves_the_old_or_the_new_values),
        cmocka_unit_test(a_power_cut_in_the_start_after_a_power_cut_harms_nothing),
        cmocka_unit_test(what_another_program_has_changed_since_holds),
        cmocka_unit_test(records_that_are_no_records_change_nothing),
        cmocka_unit_test(the_values_before_the_last_ones_stay_in_the_other_record),
        cmocka_unit_test(saving_an_entry_of_the_tables_changes_nothing_else),
        cmocka_unit_test(an_entry_beyond_the_tables_is_not_written),
        cmocka_unit_test(a_power_cut_at_any_byte_leaves_the_old_or_the_new_entry),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
