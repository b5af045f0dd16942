/// Calibration: what goes between the EEPROM, the API's variables and a CALIB message.
#include "kilolib/core/calibration.h"

#include <string.h>

#include "../../firmware/support.h"
#include "kilolib.h"
#include "kilolib/core/eeprom_map.h"

static uint8_t eeprom[EEPROM_BYTES];
static int updates;

uint8_t kilolib_eeprom_read(uint16_t address) { return eeprom[address]; }

void kilolib_eeprom_update(uint16_t address, uint8_t value) {
    updates++;
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

TEST(saving_writes_six_bytes_and_loads_them) {
    memset(eeprom, 0xFF, sizeof eeprom);
    updates = 0;
    const uint8_t data[9] = {CALIBRATION_SAVE, 0xCD, 0xAB, 81, 82, 83, 84};
    kilolib_calibration_save(data);
    assert_int_equal(updates, 6);
    assert_int_equal(eeprom[0xB0], 0xCD);
    assert_int_equal(eeprom[0xB1], 0xAB);
    assert_int_equal(eeprom[0x05], 81);
    assert_int_equal(eeprom[0x09], 82);
    assert_int_equal(eeprom[0x0C], 83);
    assert_int_equal(eeprom[0x14], 84);
    assert_int_equal(kilo_uid, 0xABCD);
    assert_int_equal(kilo_turn_left, 81);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_variables_are_what_the_eeprom_holds),
        cmocka_unit_test(an_erased_eeprom_gives_65535_and_255),
        cmocka_unit_test(saving_writes_six_bytes_and_loads_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
