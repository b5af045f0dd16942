#include "params.h"

#include <string.h>

#include "support.h"

// As numbers, in the order of wire.h.
typedef struct {
    uint8_t key;
    uint32_t preset, least, most;
} row_t;

#define ROW(name, key, preset, least, most) {key, preset, least, most},
static const row_t ROWS[] = {WIRE_CONFIG_KEYS(ROW)};
#define ROW_COUNT (sizeof ROWS / sizeof *ROWS)

static uint32_t get(const params_t *params, uint8_t key) {
    switch (key) {
#define GET(name, number, preset, least, most) \
    case number: return params->name;
        WIRE_CONFIG_KEYS(GET)
    default: fail_msg("no key %u", key); return 0;
    }
}

static params_t fresh(void) {
    params_t params;
    memset(&params, 0xA5, sizeof params);
    params_reset(&params);
    return params;
}

TEST(reset_gives_every_parameter_its_default) {
    const params_t params = fresh();
    for (size_t i = 0; i < ROW_COUNT; i++) {
        assert_int_equal(get(&params, ROWS[i].key), ROWS[i].preset);
    }
}

TEST(every_default_lies_in_its_range) {
    for (size_t i = 0; i < ROW_COUNT; i++) {
        assert_true(ROWS[i].least <= ROWS[i].preset && ROWS[i].preset <= ROWS[i].most);
    }
}

TEST(both_ends_of_every_range_are_taken_and_kept_whole) {
    for (size_t i = 0; i < ROW_COUNT; i++) {
        params_t params = fresh();
        assert_true(params_set(&params, ROWS[i].key, ROWS[i].least));
        assert_int_equal(get(&params, ROWS[i].key), ROWS[i].least);
        assert_true(params_set(&params, ROWS[i].key, ROWS[i].most));
        assert_int_equal(get(&params, ROWS[i].key), ROWS[i].most);
    }
}

TEST(setting_one_leaves_all_others_as_they_were) {
    for (size_t i = 0; i < ROW_COUNT; i++) {
        params_t params = fresh();
        assert_true(params_set(&params, ROWS[i].key, ROWS[i].most));
        for (size_t j = 0; j < ROW_COUNT; j++) {
            if (i != j) assert_int_equal(get(&params, ROWS[j].key), ROWS[j].preset);
        }
    }
}

TEST(values_out_of_range_are_refused_and_the_old_one_stays) {
    for (size_t i = 0; i < ROW_COUNT; i++) {
        params_t params = fresh();
        if (ROWS[i].least > 0) assert_false(params_set(&params, ROWS[i].key, ROWS[i].least - 1));
        if (ROWS[i].most < UINT32_MAX) {
            assert_false(params_set(&params, ROWS[i].key, ROWS[i].most + 1));
            assert_false(params_set(&params, ROWS[i].key, UINT32_MAX));
        }
        assert_int_equal(get(&params, ROWS[i].key), ROWS[i].preset);
    }
}

TEST(unknown_keys_are_refused) {
    const params_t before = fresh();
    params_t params = before;
    for (unsigned key = 0; key < 256; key++) {
        bool known = false;
        for (size_t i = 0; i < ROW_COUNT; i++) known |= ROWS[i].key == key;
        if (!known) assert_false(params_set(&params, (uint8_t)key, 1));
    }
#define SAME(name, key, preset, least, most) assert_int_equal(params.name, before.name);
    WIRE_CONFIG_KEYS(SAME)
}

TEST(no_key_is_used_twice) {
    for (size_t i = 0; i < ROW_COUNT; i++) {
        for (size_t j = i + 1; j < ROW_COUNT; j++) assert_int_not_equal(ROWS[i].key, ROWS[j].key);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reset_gives_every_parameter_its_default),
        cmocka_unit_test(every_default_lies_in_its_range),
        cmocka_unit_test(both_ends_of_every_range_are_taken_and_kept_whole),
        cmocka_unit_test(setting_one_leaves_all_others_as_they_were),
        cmocka_unit_test(values_out_of_range_are_refused_and_the_old_one_stays),
        cmocka_unit_test(unknown_keys_are_refused),
        cmocka_unit_test(no_key_is_used_twice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
