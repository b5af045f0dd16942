/// rand_soft() and rand_hard().
#include "kilolib/core/random.h"

#include "../../firmware/support.h"
#include "kilolib.h"

static uint32_t noise_asked;
static uint8_t (*noise)(void);

uint8_t kilolib_random_noise_bit(void) {
    noise_asked++;
    return noise();
}

static uint32_t state = 12345;
// A bit that is 1 in one of eight draws.
static uint8_t biased(void) {
    state = state * 1664525u + 1013904223u;
    return state >> 29 == 0;
}
static uint8_t constant(void) { return 1; }

TEST(rand_soft_has_the_original_row_from_power_up_and_after_a_seed) {
    static const uint8_t ROW[] = {0xFD, 0x15, 0xB8, 0x7B, 0xA7, 0x9A, 0x49, 0x00,
                                  0x02, 0x10, 0x96, 0x25, 0x0E, 0x7E, 0x89, 0xC4};
    for (size_t i = 0; i < sizeof ROW; i++) assert_int_equal(rand_soft(), ROW[i]);
    kilolib_random_seed(1);
    // The counter goes on: the seed alone does not decide.
    uint8_t expected = 1;
    expected ^= (uint8_t)(expected << 3);
    expected ^= expected >> 5;
    expected ^= 16 >> 2;
    assert_int_equal(rand_soft(), expected);
}

TEST(rand_hard_is_fair_though_its_noise_is_not) {
    noise = biased;
    uint32_t ones = 0;
    const uint32_t draws = 4000;
    for (uint32_t i = 0; i < draws; i++) ones += (uint32_t)__builtin_popcount(rand_hard());
    assert_binomial(ones, 8 * draws, 0.5);
}

TEST(rand_hard_gives_up_on_a_bit_that_never_changes) {
    noise = constant;
    noise_asked = 0;
    assert_int_equal(rand_hard(), 0);
    assert_int_equal(noise_asked, 8 * 2 * 128);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rand_soft_has_the_original_row_from_power_up_and_after_a_seed),
        cmocka_unit_test(rand_hard_is_fair_though_its_noise_is_not),
        cmocka_unit_test(rand_hard_gives_up_on_a_bit_that_never_changes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
