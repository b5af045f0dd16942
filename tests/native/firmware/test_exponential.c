#include "exponential.h"

#include "random.h"
#include "support.h"

#define ERROR_LIMIT 2.0L  // what exponential.h promises, in units of 2^-32

static void assert_right(uint64_t x) {
    const long double exact = expl(-ldexpl((long double)x, -32)) * 4294967296.0L;
    const uint64_t result = exponential_decay(x);
    if (fabsl((long double)result - exact) >= ERROR_LIMIT || result > EXPONENTIAL_ONE) {
        fail_msg("exp(-%llu / 2^32) * 2^32 is %Lf, got %llu", (unsigned long long)x, exact,
                 (unsigned long long)result);
    }
}

TEST(zero_gives_exactly_one) { assert_int_equal(exponential_decay(0), EXPONENTIAL_ONE); }

TEST(every_multiple_of_2_to_the_minus_16_is_right) {
    for (uint64_t x = 0; x < (uint64_t)24 << 16; x++) assert_right(x << 16);
}

TEST(the_neighbourhood_of_every_multiple_of_ln_2_is_right) {
    for (int k = 0; k <= 33; k++) {
        const uint64_t x = (uint64_t)llroundl(k * M_LN2 * 4294967296.0L);
        for (uint64_t i = 0; i < 1000; i++) {
            assert_right(x + i);
            if (x >= i) assert_right(x - i);
        }
    }
}

TEST(numbers_in_between_are_right) {
    random_t random;
    random_seed(&random, 1, 1);
    for (int i = 0; i < 300000; i++) {
        const uint64_t whole = random_next(&random) % 24;
        assert_right(whole << 32 | random_next(&random));
    }
}

TEST(what_is_below_2_to_the_minus_32_is_exactly_zero) {
    const uint64_t limit = (uint64_t)(32 * M_LN2 * 4294967296.0L);
    assert_int_equal(exponential_decay(limit - 100), 1);
    assert_int_equal(exponential_decay(limit + 100), 0);
    for (int bit = 37; bit < 64; bit++) {
        assert_int_equal(exponential_decay((uint64_t)1 << bit), 0);
        assert_int_equal(exponential_decay(((uint64_t)1 << bit) - 1), 0);
    }
    assert_int_equal(exponential_decay(UINT64_MAX), 0);
}

TEST(it_falls_but_for_rounding) {
    uint64_t before = EXPONENTIAL_ONE;
    for (uint64_t x = 0; x < (uint64_t)24 << 16; x++) {
        const uint64_t result = exponential_decay(x << 16);
        assert_true(result <= before + 2);
        before = result;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zero_gives_exactly_one),
        cmocka_unit_test(every_multiple_of_2_to_the_minus_16_is_right),
        cmocka_unit_test(the_neighbourhood_of_every_multiple_of_ln_2_is_right),
        cmocka_unit_test(numbers_in_between_are_right),
        cmocka_unit_test(what_is_below_2_to_the_minus_32_is_exactly_zero),
        cmocka_unit_test(it_falls_but_for_rounding),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
